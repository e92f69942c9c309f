// What the coordinator does about workers: registration, heartbeats, silence, slots.
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

TEST(CoordinatorWorkers, RepeatedRegisterGetsTheSameWelcome) {
  CoordinatorScript script;
  const FakeWorker worker = script.Join(11, 1);
  const auto again = ToWorkers<Welcome>(script.Worker(worker, CoordinatorScript::RegisterOf(worker)));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].to, 11U);
  EXPECT_EQ(again[0].message, (Welcome{.epoch = 77,
                                       .incarnation = 1,
                                       .worker = worker.id,
                                       .voxels_endpoint = "inproc://voxels",
                                       .heartbeat_ms = 500,
                                       .timeout_ms = 6000}));
  EXPECT_EQ(script.QueryStatus().workers.size(), 1U);
}

TEST(CoordinatorWorkers, NewIncarnationIsANewWorkerAndTakesTheSlotOfTheOneItReplaces) {
  CoordinatorScript script;
  const FakeWorker first = script.Join(11, 1);
  script.Join(12, 2);
  script.Mute(first);
  const FakeWorker second = script.Join(11, 3);
  EXPECT_NE(second.id, first.id);
  const StatusReply status = script.QueryStatus();
  ASSERT_EQ(status.workers.size(), 2U);
  EXPECT_EQ(status.workers[1].worker, second.id);
  EXPECT_EQ(status.workers[1].slot, 0U);
  EXPECT_EQ(status.workers_lost, 1U);
}

TEST(CoordinatorWorkers, HeartbeatsAreAnsweredAndStrangersRetired) {
  CoordinatorScript script;
  const FakeWorker worker = script.Join(11, 1);
  EXPECT_EQ(ToWorkers<Ping>(script.Beat(worker)).size(), 1U);

  Heartbeat other_epoch{.epoch = 76, .incarnation = 1, .worker = worker.id};
  const auto retired = ToWorkers<Retire>(script.Worker(worker, other_epoch));
  ASSERT_EQ(retired.size(), 1U);
  EXPECT_EQ(retired[0].message.epoch, 77U);
  EXPECT_EQ(ToWorkers<Retire>(script.Beat({.token = 12, .incarnation = 5, .id = 9})).size(), 1U);
  // A heartbeat under an id that this incarnation had earlier is old news and no reason to retire the worker that it is now.
  EXPECT_TRUE(ToWorkers<Retire>(script.Beat({.token = 11, .incarnation = 1, .id = 9})).empty());
}

TEST(CoordinatorWorkers, EveryWorkerIsPingedEachInterval) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  EXPECT_EQ(script.machine.NextWake(), script.now + milliseconds(500));
  script.now += milliseconds(500);
  const auto pings = ToWorkers<Ping>(script.Step(CoordinatorTick{}));
  ASSERT_EQ(pings.size(), 2U);
  EXPECT_EQ(pings[0].to, 11U);
  EXPECT_EQ(pings[1].to, 12U);
  EXPECT_EQ(script.machine.NextWake(), script.now + milliseconds(500));
}

TEST(CoordinatorWorkers, SilenceOfTheTimeoutAndNotLessTakesAWorkerOut) {
  CoordinatorScript script;
  const FakeWorker silent = script.Join(11, 1);
  script.Join(12, 2);
  script.Mute(silent);
  script.Pass(milliseconds(5999));
  EXPECT_EQ(script.QueryStatus().workers.size(), 2U);
  script.Pass(milliseconds(1));
  const StatusReply status = script.QueryStatus();
  ASSERT_EQ(status.workers.size(), 1U);
  EXPECT_EQ(status.workers[0].worker, 2U);
  EXPECT_EQ(status.workers_lost, 1U);
}

TEST(CoordinatorWorkers, PingsTellForTwoTimeoutsWhoHasGone) {
  CoordinatorScript script;
  const FakeWorker stays = script.Join(11, 1), silent = script.Join(12, 2), leaves = script.Join(13, 3);
  const auto gone = [&] { return ToWorkers<Ping>(script.Beat(stays)).at(0).message.gone; };
  EXPECT_THAT(gone(), IsEmpty());
  script.Worker(leaves, Leave{.epoch = 77, .worker = leaves.id});
  script.Mute(leaves);
  script.Mute(silent);
  EXPECT_THAT(gone(), ElementsAre(leaves.id));
  script.Pass(milliseconds(6000));
  EXPECT_THAT(gone(), ElementsAre(leaves.id, silent.id));
  script.Pass(milliseconds(5999));
  EXPECT_THAT(gone(), ElementsAre(leaves.id, silent.id));
  script.Pass(milliseconds(1));
  EXPECT_THAT(gone(), ElementsAre(silent.id));
  script.Pass(milliseconds(6000));
  EXPECT_THAT(gone(), IsEmpty());
}

TEST(CoordinatorWorkers, CoordinatorThatWasHeldUpItselfTakesNobodyForDead) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Client(21, Frame(1));
  script.now += seconds(60);  // its process was stopped: nothing was read
  script.Step(CoordinatorTick{});
  EXPECT_EQ(script.QueryStatus().workers.size(), 1U);
  EXPECT_EQ(script.QueryStatus().clients, 1U);
}

TEST(CoordinatorWorkers, CoordinatorThatWasHeldUpItselfHearsTheFirstWorkerOut) {
  CoordinatorScript script;
  script.Submit(kClient, Frame(1));
  script.now += script.config.worker_wait + milliseconds(300);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Step(CoordinatorTick{})).empty());
  EXPECT_TRUE(ToClients<FrameFailed>(script.Pass(script.config.worker_wait - Duration(1))).empty());
  EXPECT_EQ(ToClients<FrameFailed>(script.Pass(Duration(1))).size(), 1U);
}

TEST(CoordinatorWorkers, LossOfAConnectionThatAWorkerHasLeftIsNoLossOfTheWorker) {
  CoordinatorScript script;
  FakeWorker worker = script.Join(11, 1);
  worker.token = 12;  // the socket connected anew
  EXPECT_EQ(ToWorkers<Ping>(script.Beat(worker))[0].to, 12U);
  script.Step(WorkerGone{11});
  EXPECT_EQ(script.QueryStatus().workers.size(), 1U);
  script.Step(WorkerGone{12});
  EXPECT_EQ(script.QueryStatus().workers.size(), 0U);
}

TEST(CoordinatorWorkers, LeavingIsNoLoss) {
  CoordinatorScript script;
  const FakeWorker worker = script.Join(11, 1);
  script.Worker(worker, Leave{.epoch = 77, .worker = worker.id});
  EXPECT_EQ(script.QueryStatus().workers.size(), 0U);
  EXPECT_EQ(script.QueryStatus().workers_lost, 0U);
}

TEST(CoordinatorWorkers, VacantSlotIsLentForAWhileAndThenGivenUp) {
  CoordinatorScript script;
  const FakeWorker a = script.Join(11, 1);
  const FakeWorker b = script.Join(12, 2);
  script.Kill(b);
  const auto lent = HandedOut(script.Submit(21, Frame(1)));
  ASSERT_EQ(lent.size(), 1U);
  EXPECT_EQ(lent[0].group.placements.size(), 2U) << "two slots, both rendered by the one worker";
  EXPECT_EQ(WorkersOf(lent[0]), std::set<WorkerId>{a.id});
  script.Answer(lent[0]);

  script.Pass(seconds(30));
  const auto anew = HandedOut(script.Submit(21, Frame(2)));
  ASSERT_EQ(anew.size(), 1U);
  EXPECT_EQ(anew[0].group.placements.size(), 1U) << "one slot is left";
}

}  // namespace
}  // namespace slabstream
