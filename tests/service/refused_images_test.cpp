// A worker whose peer's memory cannot be opened, on either end: the image comes as runs.
#include <unistd.h>

#include "common/memory/shared_arena.h"
#include "tests/service/worker_and_peer.h"

namespace slabstream {
namespace {

class RefusedImagesTest : public WorkerAndPeer {
 protected:
  RefusedImagesTest() { EXPECT_NE(memory_scope_, 0U); }
};

TEST_F(RefusedImagesTest, TheReceiverAsksForRuns) {
  const GroupAssignment assignment = Assignment(1, kWorker);
  const LocalImage theirs = Picture(2);
  const PixelRange all = WholeFrame(assignment.setup);
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
  partial.pixels = WholeFrame(assignment.setup);
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
