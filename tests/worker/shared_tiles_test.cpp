// Tiles of shapes that workers draw for each other: what the machine starts, awaits and keeps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

class SharedTilesTest : public WorkerMachineTest {
 protected:
  static WorkerConfig Config() {
    WorkerConfig config = WorkerMachineTest::Config();
    config.images_endpoint = "tcp://127.0.0.1:1";
    return config;
  }
  void SetUp() override { Start(Config()); }

  // Both workers draw for each other.
  static GroupAssignment WithShape(FrameId frame, std::uint32_t attempt = 1) {
    GroupAssignment a = Assignment(frame, {kSelf, kPeer}, 0, 1, attempt);
    a.setup.shapes.resize(1);
    a.setup.shapes[0].bytes.dataset = 9;
    a.setup.shapes[0].bytes.description.geometry.size = {100, 1, 1};
    if (attempt == 1) a.tiles = {{kSelf, kPeer, {0, 2}}, {kPeer, kSelf, {1}}};
    return a;
  }
  static ShapeTiles FromPeer(const GroupKey& key) {
    return {.epoch = kEpoch, .from_worker = kPeer, .key = key, .tiles = {1}, .bytes = {0}};
  }
};

TEST_F(SharedTilesTest, ItsOwnAreDrawnOnceTheShapesAreThere) {
  const Actions begun = Tell(WithShape(1));
  EXPECT_THAT(All<DrawTiles>(begun), IsEmpty()) << "the shape has to come first";
  const auto draws = All<DrawTiles>(Feed(begun));
  ASSERT_THAT(draws, SizeIs(1));
  EXPECT_EQ(draws[0].from, kSelf);
  EXPECT_EQ(draws[0].key, (GroupKey{1, 1, 0}));
  ASSERT_THAT(draws[0].shapes, SizeIs(1));
  EXPECT_EQ(draws[0].shapes[0].dataset, 9U);
  ASSERT_THAT(draws[0].receivers, SizeIs(1));
  EXPECT_EQ(draws[0].receivers[0].to.worker, kPeer);
  EXPECT_THAT(draws[0].receivers[0].tiles, ElementsAre(0U, 2U));
  EXPECT_FALSE(draws[0].receivers[0].colors) << "this worker displays the frame";
  EXPECT_THAT(Feed(Tell(WithShape(1))), IsEmpty()) << "the same assignment again changes nothing";
}

TEST_F(SharedTilesTest, RanksWaitForThoseOfOthers) {
  EXPECT_THAT(All<StartRender>(Feed(Tell(WithShape(1)))), IsEmpty());
  const Bytes payload(std::vector<std::byte>(3));
  const Actions came = Tell(FromPeer({1, 1, 0}), payload);
  EXPECT_THAT(All<StartRender>(came), SizeIs(1));
  const auto kept = All<KeepTiles>(came);
  ASSERT_THAT(kept, SizeIs(1));
  EXPECT_EQ(kept[0].message, FromPeer({1, 1, 0}));
  EXPECT_EQ(kept[0].payload.size(), 3U);
}

TEST_F(SharedTilesTest, NobodyWaitsForThemForLong) {
  Feed(Tell(WithShape(1)));
  EXPECT_THAT(All<StartRender>(After(Config().tile_patience - Duration(1))), IsEmpty());
  EXPECT_THAT(All<StartRender>(After(Duration(1))), SizeIs(1));
  EXPECT_THAT(All<KeepTiles>(Tell(FromPeer({1, 1, 0}))), SizeIs(1)) << "what has not been drawn yet need not be";
}

// A frame that waits does not hold up one that does not.
TEST_F(SharedTilesTest, OtherFramesGoAhead) {
  Feed(Tell(WithShape(1)));
  const auto next = All<StartRender>(Feed(Tell(Assignment(2, {kSelf}))));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].key.frame, 2U);
}

TEST_F(SharedTilesTest, ThoseThatComeBeforeTheirAssignmentAreKept) {
  EXPECT_THAT(Tell(FromPeer({1, 1, 0})), IsEmpty());
  EXPECT_EQ(machine->sizes().early_images, 1U);
  const Actions begun = Feed(Tell(WithShape(1)));
  EXPECT_THAT(All<KeepTiles>(begun), SizeIs(1));
  EXPECT_THAT(All<StartRender>(begun), SizeIs(1));
  EXPECT_EQ(machine->sizes().early_images, 0U);
}

TEST_F(SharedTilesTest, ThoseThatComeBeforeTheWelcomeAreKept) {
  Start(Config(), false);
  Tell(Tick{});
  ShapeTiles foreign = FromPeer({1, 1, 0});
  foreign.epoch = kEpoch + 1;
  EXPECT_THAT(Tell(foreign), IsEmpty());
  EXPECT_THAT(Tell(FromPeer({1, 1, 0})), IsEmpty());
  Tell(WelcomeTo(1000));
  const auto kept = All<KeepTiles>(Feed(Tell(WithShape(1))));
  ASSERT_THAT(kept, SizeIs(1)) << "of its epoch";
  EXPECT_EQ(kept[0].message.epoch, kEpoch);
}

TEST_F(SharedTilesTest, OtherFramesAttemptsAndEpochsAreDropped) {
  Feed(Tell(WithShape(2)));
  EXPECT_THAT(Tell(FromPeer({2, 0, 0})), IsEmpty());
  ShapeTiles foreign = FromPeer({2, 1, 0});
  foreign.epoch = kEpoch + 1;
  EXPECT_THAT(Tell(foreign), IsEmpty());
  Tell(Ping{kEpoch, 2, {}});
  EXPECT_THAT(Tell(FromPeer({1, 1, 0})), IsEmpty()) << "frame 1 is over";
  EXPECT_EQ(machine->sizes().early_images, 0U);
}

TEST_F(SharedTilesTest, ALaterAttemptNeitherWaitsNorDraws) {
  Feed(Tell(WithShape(1)));
  const Actions again = Feed(Tell(WithShape(1, 2)));
  EXPECT_THAT(All<StartRender>(again), SizeIs(1));
  EXPECT_THAT(All<DrawTiles>(again), IsEmpty());
  EXPECT_THAT(All<KeepTiles>(Tell(FromPeer({1, 1, 0}))), IsEmpty());
}

// Of workers in one process, what one of them draws is there for all.
TEST_F(SharedTilesTest, WorkersOfOneProcessSendNone) {
  Start(WorkerMachineTest::Config());
  const Actions begun = Feed(Tell(WithShape(1)));
  EXPECT_THAT(All<DrawTiles>(begun), IsEmpty());
  EXPECT_THAT(All<StartRender>(begun), SizeIs(1));
}

// It draws for others before it has a box of its own in the frame.
TEST_F(SharedTilesTest, AWorkerWithoutABoxInTheFirstGroupDraws) {
  GroupAssignment a = WithShape(1);
  a.group.placements.erase(a.group.placements.begin());
  a.group.schedule.ranks = 1;
  a.display = kPeer;
  a.peers = {{kPeer, "tcp://127.0.0.1:2"}};
  a.others = {{kSelf, "tcp://127.0.0.1:1"}};
  const Actions begun = Feed(Tell(a));
  EXPECT_THAT(All<DrawTiles>(begun), SizeIs(1));
  EXPECT_THAT(All<StartRender>(begun), IsEmpty());
  Tell(FromPeer({1, 1, 0}));
  EXPECT_EQ(machine->sizes().renders, 0U);
  Tell(Ping{kEpoch, 2, {}});
  EXPECT_EQ(machine->sizes().frames, 0U);
}

TEST_F(SharedTilesTest, ALostFrameLeavesNothing) {
  Feed(Tell(WithShape(1)));
  Tell(FromPeer({2, 1, 0}));
  Tell(Ping{kEpoch, 3, {}});
  const WorkerSizes sizes = machine->sizes();
  EXPECT_EQ(sizes.frames + sizes.early_images + sizes.renders + sizes.chunk_requests, 0U);
}

}  // namespace
}  // namespace slabstream
