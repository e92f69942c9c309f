// A worker whose peer's memory cannot be opened, on either end: the image comes as runs. The test plays the coordinator and the peer.
#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>

#include "common/base/shared_arena.h"
#include "common/wire/payload.h"
#include "tests/support/random_image.h"
#include "worker/service.h"

namespace slabstream {
namespace {

constexpr Epoch kEpoch = 9;
constexpr WorkerId kWorker = 1, kPeer = 2;
constexpr std::int32_t kSide = 200;
constexpr const char *kWorkerImages = "inproc://refused.worker", *kPeerImages = "inproc://refused.peer";

LocalImage Picture(std::uint64_t seed) {
  Random random(seed);
  return RandomImage(random, PixelFormat::kRgba, {0, 0, kSide, kSide});
}

class FixedPicture : public Renderer {
 public:
  Result<LocalImage> Render(SlabData&, const Box&, const FrameSetup&, const OcclusionMask&, const std::atomic<bool>&,
                            RankReport&) override {
    return Picture(1);
  }
};

class RefusedImagesTest : public testing::Test {
 protected:
  RefusedImagesTest()
      : control_(*Socket::Router(context_)),
        slabs_(*Socket::Router(context_)),
        images_(*Socket::Router(context_)),
        to_worker_(*Socket::Dealer(context_)) {
    CHECK(control_.Bind("inproc://refused.control").ok() && slabs_.Bind("inproc://refused.slabs").ok() && images_.Bind(kPeerImages).ok());
    WorkerOptions options;
    options.coordinator_endpoint = "inproc://refused.control";
    options.images_endpoint = kWorkerImages;
    options.make_renderer = [](RendererKind) { return std::make_unique<FixedPicture>(); };
    worker_ = WorkerService::Start(context_, std::move(options)).value();
    CHECK(to_worker_.Connect(kWorkerImages).ok());
    const auto hello = Await<Register>();
    EXPECT_NE(hello.memory_scope, 0U);
    SendControl(Welcome{kEpoch, hello.incarnation, kWorker, "inproc://refused.slabs", 1000, 60000});
  }

  void SendControl(const AnyMessage& message) { ASSERT_TRUE(control_.Send(identity_, Encode(message)).ok()); }
  void SendToWorker(const AnyMessage& message, const Bytes& payload = {}) {
    ASSERT_TRUE(to_worker_.Send({}, Encode(message), payload).ok());
  }

  // The next message of this kind that the worker sends anywhere; chunks are handed out meanwhile.
  template <class Message>
  Message Await() {
    const Time deadline = MonotonicNow() + std::chrono::seconds(30);
    while (MonotonicNow() < deadline) {
      Socket* const sockets[] = {&control_, &slabs_, &images_};
      Wait(sockets, nullptr, std::chrono::seconds(1));
      for (Socket* socket : sockets) {
        while (auto incoming = socket->TryReceive()) {
          const AnyMessage message = Decode(incoming->parts[0].span()).value();
          if (socket == &control_) identity_ = incoming->identity;
          if (const auto* request = std::get_if<ChunkRequest>(&message)) Serve(incoming->identity, *request);
          payload_ = incoming->parts.size() > 1 ? incoming->parts[1] : Bytes();
          if (const auto* wanted = std::get_if<Message>(&message)) return *wanted;
        }
      }
    }
    ADD_FAILURE() << "the message did not come";
    return {};
  }

  void Serve(const std::string& identity, const ChunkRequest& request) {
    Chunk chunk = {.epoch = kEpoch, .dataset = request.dataset, .box = request.box, .chunk = request.chunk};
    const Bytes payload = PackChunk(Bytes(std::vector<std::byte>(std::size_t(request.box.voxel_count()))), Codec::kRaw, chunk);
    ASSERT_TRUE(slabs_.Send(identity, Encode(chunk), payload).ok());
  }

  // Rank 0, the root, is `root`; both ranks render everything.
  GroupAssignment Assignment(FrameId frame, WorkerId root) {
    GroupAssignment assignment;
    assignment.epoch = kEpoch;
    assignment.key = {frame, 0, 0};
    assignment.finished_before = frame;
    assignment.group_count = 2;
    FrameSetup& setup = assignment.setup;
    setup.dataset = 1;
    setup.description.geometry.size = {8, 8, 32};
    setup.range = {0, 1};
    setup.camera = MakeCamera({}, {kSide, kSide}, setup.description.geometry);
    setup.sheets = MakeSheetGrid(setup.camera, setup.description.geometry);
    setup.sheets.width = setup.sheets.height = kSide;
    setup.transfer.colors = {{0, {1, 1, 1}}};
    setup.transfer.opacities = {{0, 1, 0.5, 0}};
    setup.termination = 0;
    assignment.group.placements = {{0, {{0, 0, 0}, {8, 8, 16}}, root}, {1, {{0, 0, 16}, {8, 8, 32}}, kWorker + kPeer - root}};
    assignment.group.schedule = MakeFanIn({2, 0, WholeFrame(setup)});
    assignment.display = root;
    assignment.peers = {{kWorker, kWorkerImages, SharedMemoryScope()}, {kPeer, kPeerImages, SharedMemoryScope()}};
    return assignment;
  }

  Context context_;
  Socket control_, slabs_, images_, to_worker_;
  std::unique_ptr<WorkerService> worker_;
  std::string identity_;  // of the worker's control connection
  Bytes payload_;         // of the message that Await returned
};

TEST_F(RefusedImagesTest, TheReceiverAsksForRuns) {
  const GroupAssignment assignment = Assignment(1, kWorker);
  const LocalImage theirs = Picture(2);
  const PixelRange all = assignment.group.schedule.steps[0].pixels;
  PartialImage partial = {.epoch = kEpoch, .from_worker = kPeer, .key = assignment.key, .step = 0, .interval = {1, 2}, .pixels = all};
  // Nobody has such a descriptor. It comes before the assignment: the worker does not know yet whom to tell.
  partial.shared = SharedImage{{5, std::uint32_t(::getpid()), 99999}, {0, 0, kSide, kSide}, kSide, 0, {{65536, 1, 0}}};
  SendToWorker(partial, Bytes(std::vector<std::byte>(8 * kSide)));
  SendControl(assignment);
  const auto refused = Await<ImageRefused>();
  EXPECT_EQ(refused, (ImageRefused{kEpoch, kWorker, assignment.key, 0, all}));

  RunImage runs = EncodeRuns(theirs, all, kSide);
  partial.shared.reset();
  partial.image = runs.header;
  SendToWorker(partial, Bytes(std::move(runs.payload)));
  EXPECT_EQ(Await<GroupDone>().key, assignment.key);
}

TEST_F(RefusedImagesTest, TheSenderSendsRunsAndLendsNoMore) {
  const LocalImage mine = Picture(1);
  const GroupAssignment assignment = Assignment(1, kPeer);
  const RunImage expected = EncodeRuns(mine, WholeFrame(assignment.setup), kSide);
  SendControl(assignment);
  const auto lent = Await<PartialImage>();
  ASSERT_TRUE(lent.shared.has_value());
  SendToWorker(ImageRefused{kEpoch, kPeer, lent.key, lent.step, lent.pixels});
  const auto sent = Await<PartialImage>();
  EXPECT_FALSE(sent.shared.has_value());
  EXPECT_EQ(sent.key, lent.key);
  EXPECT_EQ(sent.image, expected.header);
  EXPECT_TRUE(std::ranges::equal(payload_.span(), expected.payload));

  SendControl(Assignment(2, kPeer));
  const auto next = Await<PartialImage>();
  EXPECT_EQ(next.key.frame, 2U);
  EXPECT_FALSE(next.shared.has_value());
}

TEST_F(RefusedImagesTest, AWrongDescriptionFailsTheGroupAndNothingElse) {
  const GroupAssignment assignment = Assignment(1, kWorker);
  PartialImage partial = {.epoch = kEpoch, .from_worker = kPeer, .key = assignment.key, .step = 0, .interval = {1, 2}};
  partial.pixels = assignment.group.schedule.steps[0].pixels;
  // The worker's own memory exists, but no such block is lent in it.
  partial.shared = SharedImage{*SharedBlocksArena(), {0, 0, kSide, kSide}, kSide, 0, {{kArenaBytes - 4096, 1, 0}}};
  SendControl(assignment);
  SendToWorker(partial, Bytes(std::vector<std::byte>(8 * kSide)));
  EXPECT_EQ(Await<WorkerTrouble>().key, assignment.key);

  const GroupAssignment again = Assignment(2, kWorker);
  SendControl(again);
  partial.key = again.key;
  RunImage runs = EncodeRuns(Picture(2), partial.pixels, kSide);
  partial.shared.reset();
  partial.image = runs.header;
  SendToWorker(partial, Bytes(std::move(runs.payload)));
  EXPECT_EQ(Await<GroupDone>().key, again.key);
}

}  // namespace
}  // namespace slabstream
