// The worker machine and its coordinator: taken in, heard of, lost, left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/worker/worker_machine_fixture.h"

namespace slabstream {
namespace {

class WorkerRegistrationTest : public WorkerMachineTest {};

TEST_F(WorkerRegistrationTest, RegistersUntilWelcome) {
  Start(Config(), false);
  EXPECT_THAT(Sent<Register>(Tell(Tick{})), SizeIs(1));
  EXPECT_THAT(Sent<Register>(After(milliseconds(10))), IsEmpty());
  EXPECT_EQ(machine->NextWake(), now + milliseconds(990));
  const auto again = Sent<Register>(After(milliseconds(990)));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].incarnation, 1000U);
  EXPECT_EQ(again[0].images_endpoint, "inproc://self");

  EXPECT_THAT(Tell(WelcomeTo(999)), IsEmpty()) << "a welcome to somebody else";
  const Actions welcomed = Tell(WelcomeTo(1000));
  EXPECT_EQ(machine->worker(), kSelf);
  ASSERT_THAT(All<ConnectVoxels>(welcomed), SizeIs(1));
  EXPECT_EQ(All<ConnectVoxels>(welcomed)[0].endpoint, "inproc://voxels");
  EXPECT_THAT(Sent<Heartbeat>(welcomed), SizeIs(1));
  EXPECT_THAT(Tell(WelcomeTo(1000)), IsEmpty()) << "a second copy changes nothing";
}

TEST_F(WorkerRegistrationTest, BeatsAndFallsSilentWithItsCoordinator) {
  EXPECT_THAT(Sent<Heartbeat>(After(milliseconds(500))), SizeIs(1));
  Tell(Ping{kEpoch, 0, {}});
  After(milliseconds(5900));
  EXPECT_TRUE(machine->registered());
  Tell(Ping{kEpoch + 1, 0, {}});  // of another coordinator: not a sign of life of this one
  const auto registers = Sent<Register>(After(milliseconds(100)));
  EXPECT_FALSE(machine->registered());
  ASSERT_THAT(registers, SizeIs(1));
  EXPECT_EQ(registers[0].incarnation, 1001U) << "what it held is gone, so it is a new worker";
  EXPECT_THAT(Tell(WelcomeTo(1000)), IsEmpty());
  EXPECT_FALSE(Tell(WelcomeTo(1001)).empty());
  EXPECT_TRUE(machine->registered());
}

// A process that was stopped and continued: the coordinator's messages wait to be read, and it may not have noticed.
TEST_F(WorkerRegistrationTest, ItsOwnSleepIsNotTheCoordinatorsSilence) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  now += seconds(20);
  EXPECT_FALSE(Rendered(render).empty());  // the first thing that it hears is not from the coordinator
  EXPECT_TRUE(machine->registered());
  Tell(Ping{kEpoch, 0, {}});
  After(milliseconds(5900));
  EXPECT_TRUE(machine->registered());
  After(milliseconds(100));
  EXPECT_FALSE(machine->registered()) << "it was awake all the time";
}

TEST_F(WorkerRegistrationTest, RetireMakesItRegisterAgain) {
  EXPECT_THAT(Sent<Register>(Tell(Retire{kEpoch + 1})), SizeIs(1));
  EXPECT_FALSE(machine->registered());
  EXPECT_THAT(Tell(Retire{kEpoch + 1}), IsEmpty());
}

TEST_F(WorkerRegistrationTest, RegistersAgainWhereItsImagesComeNow) {
  const auto registers = Sent<Register>(Tell(Moved{"inproc://elsewhere"}));
  EXPECT_FALSE(machine->registered());
  ASSERT_THAT(registers, SizeIs(1));
  EXPECT_EQ(registers[0].images_endpoint, "inproc://elsewhere");
  EXPECT_EQ(registers[0].incarnation, 1001U);
}

TEST_F(WorkerRegistrationTest, SaysWhichSlotItHad) {
  Tell(Ping{kEpoch, 0, {}, {.slot = 2, .slots = 5}});
  const auto registers = Sent<Register>(Tell(Retire{kEpoch + 1}));
  ASSERT_THAT(registers, SizeIs(1));
  EXPECT_EQ(registers[0].place, (SlotPlace{.slot = 2, .slots = 5}));
}

TEST_F(WorkerRegistrationTest, LeavesInOrderAndObeysStop) {
  const Actions leaving = Tell(StopRequested{});
  EXPECT_THAT(Sent<Leave>(leaving), SizeIs(1));
  EXPECT_THAT(All<StopProcess>(leaving), SizeIs(1));
  EXPECT_EQ(machine->NextWake(), Time::max());
  EXPECT_THAT(After(seconds(10)), IsEmpty());

  Start(Config());
  EXPECT_THAT(All<StopProcess>(Tell(Stop{kEpoch + 1})), IsEmpty()) << "another coordinator's";
  EXPECT_THAT(All<StopProcess>(Tell(Stop{kEpoch})), SizeIs(1));
}

TEST_F(WorkerRegistrationTest, LeavingSaysSoAndGoesOnUntilItIsStopped) {
  const auto render = All<StartRender>(Feed(Tell(Assignment(1, {kSelf})))).at(0);
  const auto beats = Sent<Heartbeat>(Tell(LeaveRequested{}));
  ASSERT_THAT(beats, SizeIs(1)) << "at once";
  EXPECT_TRUE(beats[0].leaving);
  EXPECT_THAT(Sent<GroupDone>(Rendered(render)), SizeIs(1)) << "it finishes what it has";
  const auto later = Sent<Heartbeat>(After(milliseconds(500)));
  ASSERT_THAT(later, SizeIs(1));
  EXPECT_TRUE(later[0].leaving) << "the first one may be lost";
  EXPECT_THAT(All<StopProcess>(Tell(LeaveRequested{})), IsEmpty());
  const auto ends = All<StopProcess>(Tell(Stop{kEpoch}));
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].rendered_ranks, 1U);
}

TEST_F(WorkerRegistrationTest, LeavingEndsWhenItsTimeIsOver) {
  WorkerConfig config = Config();
  config.drain = milliseconds(1200);
  Start(config);
  Feed(Tell(Assignment(1, {kSelf})));
  Tell(LeaveRequested{});
  EXPECT_THAT(All<StopProcess>(After(milliseconds(1199))), IsEmpty());
  const Actions over = After(milliseconds(1));
  EXPECT_THAT(Sent<Leave>(over), SizeIs(1)) << "the coordinator need not wait for its silence";
  EXPECT_THAT(All<StopProcess>(over), SizeIs(1));

  config.drain = {};
  Start(config);
  EXPECT_THAT(All<StopProcess>(Tell(LeaveRequested{})), SizeIs(1)) << "no time at all";
}

TEST_F(WorkerRegistrationTest, LeavingEndsWithoutACoordinator) {
  Tell(LeaveRequested{});
  const Actions retired = Tell(Retire{kEpoch + 1});
  EXPECT_THAT(All<StopProcess>(retired), SizeIs(1)) << "a new coordinator has no part of any frame for it";
  EXPECT_THAT(Sent<Register>(retired), IsEmpty());

  Start(Config());
  Tell(LeaveRequested{});
  EXPECT_THAT(All<StopProcess>(After(milliseconds(5999))), IsEmpty());
  EXPECT_THAT(All<StopProcess>(After(milliseconds(1))), SizeIs(1)) << "silence";

  Start(Config(), false);
  Tell(Tick{});
  EXPECT_THAT(All<StopProcess>(Tell(LeaveRequested{})), SizeIs(1)) << "never registered";
}

TEST_F(WorkerRegistrationTest, LosingTheCoordinatorReleasesEverything) {
  const auto first = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 0, 2)))).at(0);
  Rendered(first);
  const auto second = All<StartRender>(Feed(Tell(Assignment(1, {kSelf}, 1, 2)))).at(0);
  const Actions lost = After(seconds(6));
  EXPECT_THAT(All<CancelRender>(lost), SizeIs(1));
  EXPECT_THAT(All<ReleaseImage>(lost), ElementsAre(testing::Field(&ReleaseImage::image, first.image)));
  EXPECT_THAT(All<DropBox>(lost), IsEmpty());
  EXPECT_THAT(All<ReleaseImage>(Rendered(second)), SizeIs(1));
}

}  // namespace
}  // namespace slabstream
