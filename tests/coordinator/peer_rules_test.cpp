// What the coordinator believes: of peers that speak for others, of workers that do not hear it, and of its own clock.
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

constexpr PeerToken kStranger = 66;

FrameImage PictureOf(const GroupAssignment& group) {
  return {.epoch = 77,
          .worker = group.display,
          .frame = group.key.frame,
          .attempt = group.key.attempt,
          .groups_done = group.group_count,
          .group_count = group.group_count};
}

TEST(CoordinatorPeers, NobodySpeaksForAnotherWorker) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 3)));
  const GroupAssignment& group = groups.at(0);
  const PeerToken other = group.display == 1 ? 12 : 11;
  const WorkerTrouble trouble{77, group.display, group.key, 0, Status::ResourceExhausted("no memory"), true};
  for (const PeerToken from : {kStranger, other}) {
    EXPECT_THAT(script.Step(FromWorker{from, GroupDone{.epoch = 77, .worker = group.display, .key = group.key}, {}}), IsEmpty());
    EXPECT_THAT(script.Step(FromWorker{from, PictureOf(group), {}}), IsEmpty());
    EXPECT_THAT(HandedOut(script.Step(FromWorker{from, trouble, {}})), IsEmpty());
    script.Step(FromWorker{from, Leave{77, group.display}, {}});
  }
  EXPECT_THAT(script.QueryStatus().workers, SizeIs(2));
  EXPECT_THAT(ToClients<FrameReply>(script.Image(group, 3)), SizeIs(1)) << "the display worker's own word counts";
}

TEST(CoordinatorPeers, NobodySpeaksForAWorkerThatWasLost) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
  script.Kill(script.WorkerOf(groups.at(0).display));
  EXPECT_THAT(ToClients<FrameReply>(script.Step(FromWorker{kStranger, PictureOf(groups[0]), {}})), IsEmpty());
  EXPECT_THAT(ToClients<FrameReply>(script.Image(groups[0], 2)), SizeIs(1));
}

// What was under way on the old connection may be lost, so that waiting for it would take the whole stall time-out.
TEST(CoordinatorPeers, FrameOfAWorkerThatConnectsAnewIsHandedOutAgain) {
  CoordinatorScript script;
  FakeWorker worker = script.Join(11, 1);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 1)));
  worker.token = 12;
  const auto again = HandedOut(script.Beat(worker));
  EXPECT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 0}));
  EXPECT_THAT(HandedOut(script.Beat(worker)), IsEmpty()) << "once";
  EXPECT_THAT(ToClients<FrameReply>(script.Step(FromWorker{12, PictureOf(again.at(0)), {}})), SizeIs(1));
}

// It hears nothing of the coordinator, which hears it: it registers again and again and does nothing else.
TEST(CoordinatorPeers, WorkerThatDoesNotHearItsWelcomeIsLost) {
  CoordinatorScript script;
  script.Join(11, 1);
  const FakeWorker deaf = script.Join(12, 2);
  script.Mute(deaf);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 1)));
  ASSERT_EQ(WorkersOf(groups.at(0)).size(), 2U);
  for (int s = 1; s < 6; ++s) {
    EXPECT_THAT(HandedOut(script.Pass(seconds(1))), IsEmpty());
    script.Worker(deaf, CoordinatorScript::RegisterOf(deaf));
  }
  const auto again = HandedOut(script.Pass(seconds(1)));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].key.attempt, 2U);
  EXPECT_EQ(WorkersOf(again[0]), std::set<WorkerId>{1});
}

// A hidden box is left out at once, whatever else its worker renders at the time.
TEST(CoordinatorPeers, WorkerThatLeftOutAYoungerFramesBoxIsStillAtTheOlderFrame) {
  for (const std::int64_t render_ns : {0, 5}) {
    CoordinatorScript script;
    script.Join(11, 1);
    const auto older = HandedOut(script.Submit(kClient, Frame(1, 1)));
    const auto younger = HandedOut(script.Submit(kClient, Frame(2, 1)));
    ASSERT_THAT(Keys(younger), ElementsAre(GroupKey{2, 1, 0}));
    RankReport report{.worker = 1};
    report.stage_ns[std::size_t(Stage::kRender)] = render_ns;
    script.Done(younger[0], {report});
    std::vector<GroupAssignment> again;
    for (int s = 0; s < 61 && again.empty(); ++s) {
      ++script.WorkerOf(1).rendered_ranks;  // of a long frame
      again = HandedOut(script.Pass(seconds(1)));
    }
    const bool stalls = std::ranges::any_of(again, [](const GroupAssignment& group) { return group.key.frame == 1; });
    EXPECT_EQ(stalls, render_ns > 0);
  }
}

// The machine was stopped, or its clock jumped: that is nobody's silence, no lack of progress, and no time in which a worker could come.
TEST(CoordinatorPeers, TimeInWhichTheCoordinatorStoodStillCountsForNothing) {
  CoordinatorScript script;
  script.Join(11, 1);
  const FakeWorker lost = script.Join(12, 2);
  script.Kill(lost);
  script.Submit(kClient, Frame(1, 1));
  script.now += seconds(100);
  const Actions resumed = script.Step(CoordinatorTick{});
  EXPECT_THAT(HandedOut(resumed), IsEmpty()) << "no stall";
  EXPECT_EQ(script.machine.sizes().slots, 2U) << "the vacant slot is still kept";
}

TEST(CoordinatorPeers, WaitForTheFirstWorkerEndsThoughEveryWakeUpIsALittleLate) {
  CoordinatorScript script;
  Actions actions = script.Submit(kClient, Frame(1));
  const Time end = script.now + seconds(12);
  while (script.now < end) {
    script.now = std::min(script.machine.NextWake(), end) + milliseconds(2);
    CoordinatorScript::Append(actions, script.Client(kClient, ClientPing{}));
    CoordinatorScript::Append(actions, script.Step(CoordinatorTick{}));
  }
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kUnavailable);
}

TEST(CoordinatorPeers, WaitForTheFirstWorkerBeginsAnewWhenTheCoordinatorStoodStill) {
  ScriptConfig config = TestConfig();
  config.client_timeout = seconds(1000);
  CoordinatorScript script(config);
  script.Submit(kClient, Frame(1, 1));
  script.now += seconds(100);
  EXPECT_THAT(ToClients<FrameFailed>(script.Step(CoordinatorTick{})), IsEmpty());
  EXPECT_THAT(ToClients<FrameFailed>(script.Pass(milliseconds(9999))), IsEmpty());
  EXPECT_THAT(ToClients<FrameFailed>(script.Pass(milliseconds(1))), SizeIs(1));
}

}  // namespace
}  // namespace slabstream
