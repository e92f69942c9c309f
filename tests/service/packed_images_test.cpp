// Images that travel in frames: packed or not, answered or not.
#include "tests/service/worker_and_peer.h"

namespace slabstream {
namespace {

WorkerOptions Frames(LinkCompression compression) {
  WorkerOptions options;
  options.share_memory = false;
  options.machine.compression = compression;
  return options;
}

class PackedImagesTest : public WorkerAndPeer {
 protected:
  PackedImagesTest() : WorkerAndPeer(Frames(LinkCompression::kOn)) {}
};

TEST_F(PackedImagesTest, TheReceiverGetsWhatWasPacked) {
  const GroupAssignment assignment = Assignment(1, kPeer);
  const RunImage expected = EncodeRuns(Picture(1), WholeFrame(assignment.setup), kSide);
  SendControl(assignment);
  const auto sent = Await<PartialImage>();
  ASSERT_TRUE(sent.packed.has_value());
  EXPECT_EQ(sent.image, expected.header);
  EXPECT_EQ(sent.acknowledge, 0U) << "how fast the link is does not matter";
  const Result<Bytes> unpacked = UnpackRuns(*sent.packed, payload_, expected.payload.size());
  ASSERT_TRUE(unpacked.ok()) << unpacked.status().message();
  EXPECT_TRUE(std::ranges::equal(unpacked->span(), expected.payload));
}

// Frame 1 has a packed image of the peer, as `damage` leaves it; frame 2 a good one. Whether frame 1 was combined.
class PackedInputTest : public PackedImagesTest {
 protected:
  template <class Damage>
  bool Combines(Damage&& damage) {
    const GroupAssignment assignment = Assignment(++frame_, kWorker);
    const RunImage runs = EncodeRuns(Picture(2), WholeFrame(assignment.setup), kSide);
    PackedRuns how;
    const Bytes packed = *PackRuns(runs.payload, how);
    std::vector<std::byte> payload(packed.span().begin(), packed.span().end());
    PartialImage partial = {.epoch = kEpoch, .from_worker = kPeer, .key = assignment.key, .step = 0, .interval = {1, 2}};
    partial.pixels = WholeFrame(assignment.setup);
    partial.image = runs.header;
    partial.packed = how;
    damage(partial, payload);
    SendControl(assignment);
    SendToWorker(partial, Bytes(std::move(payload)));
    while (true) {
      const AnyMessage answer = AwaitEither<GroupDone, WorkerTrouble>();
      if (const auto* trouble = std::get_if<WorkerTrouble>(&answer)) {
        if (trouble->key == assignment.key) return false;
      } else if (std::get<GroupDone>(answer).key == assignment.key) {
        return true;
      }
    }
  }

 private:
  FrameId frame_ = 0;
};

TEST_F(PackedInputTest, DamageFailsTheGroupAndNothingElse) {
  EXPECT_TRUE(Combines([](PartialImage&, std::vector<std::byte>&) {}));
  EXPECT_FALSE(Combines([](PartialImage&, std::vector<std::byte>& payload) { payload[payload.size() / 2] ^= std::byte{1}; }));
  EXPECT_FALSE(Combines([](PartialImage& partial, std::vector<std::byte>& payload) {  // well packed, of another size
    partial.image.pixel_count -= 1;
    EXPECT_GT(PayloadBytes(partial.image), payload.size());
  }));
  EXPECT_FALSE(Combines([](PartialImage& partial, std::vector<std::byte>&) {  // 2 GiB, of a frame that has no such pixels
    partial.image.bounds = {0, 0, 10000, 10000};
    partial.image.pixel_count = 100'000'000;
  }));
  EXPECT_TRUE(Combines([](PartialImage&, std::vector<std::byte>&) {}));
}

class AcknowledgedImagesTest : public WorkerAndPeer {
 protected:
  AcknowledgedImagesTest() : WorkerAndPeer(Frames(LinkCompression::kAuto), "tcp://127.0.0.1:*") { peer_scope_ = memory_scope_ + 1; }
};

TEST_F(AcknowledgedImagesTest, WithinAHostNothingIsTimedOrPacked) {
  peer_scope_ = memory_scope_;
  for (FrameId frame = 1; frame <= 5; ++frame) {
    SendControl(Assignment(frame, kPeer));
    const auto sent = Await<PartialImage>();
    EXPECT_EQ(sent.acknowledge, 0U);
    EXPECT_FALSE(sent.packed.has_value());
    EXPECT_FALSE(sent.shared.has_value());
  }
}

TEST_F(AcknowledgedImagesTest, ASenderAsksOneAtATime) {
  SendControl(Assignment(1, kPeer));
  const auto first = Await<PartialImage>();
  EXPECT_NE(first.acknowledge, 0U);
  EXPECT_FALSE(first.packed.has_value()) << "of an unknown link";
  SendControl(Assignment(2, kPeer));
  EXPECT_EQ(Await<PartialImage>().acknowledge, 0U);
  SendToWorker(ImageReceived{kEpoch, kPeer, first.acknowledge});
  SendToWorker(ImageReceived{kEpoch, kPeer, first.acknowledge});  // again: nothing happens
  // The answer and the assignment come by different sockets: it counts for one of the next frames.
  PartialImage next;
  for (FrameId frame = 3; next.acknowledge == 0 && frame < 1000; ++frame) {
    SendControl(Assignment(frame, kPeer));
    next = Await<PartialImage>();
  }
  EXPECT_GT(next.acknowledge, first.acknowledge);
}

TEST_F(AcknowledgedImagesTest, AReceiverAnswersWhatIsLargeEnough) {
  for (FrameId frame = 1; frame <= 2; ++frame) {
    const GroupAssignment assignment = Assignment(frame, kWorker);
    PartialImage partial = {.epoch = kEpoch, .from_worker = kPeer, .key = assignment.key, .step = 0, .interval = {1, 2}};
    partial.pixels = WholeFrame(assignment.setup);
    SendControl(assignment);
    if (frame == 1) {  // too small to be answered
      partial.acknowledge = 77;
      SendToWorker(partial);
      EXPECT_EQ(Await<GroupDone>().key, assignment.key);
      continue;
    }
    RunImage runs = EncodeRuns(Picture(2), partial.pixels, kSide);
    ASSERT_GE(runs.payload.size(), kLeastAcknowledgedBytes);
    partial.image = runs.header;
    partial.acknowledge = 78;
    SendToWorker(partial, Bytes(std::move(runs.payload)));
    EXPECT_EQ(Await<ImageReceived>(), (ImageReceived{kEpoch, kWorker, 78}));
  }
}

}  // namespace
}  // namespace slabstream
