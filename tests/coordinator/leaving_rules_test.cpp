// What the coordinator does about workers that leave with notice: they finish what they have, and nothing is rendered twice.
#include <map>

#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

// Every group that is handed out, with how often each box was, over all attempts.
struct Handed {
  std::vector<GroupAssignment> waiting;  // for their answers
  std::map<BoxId, int> boxes;
  std::vector<GroupAssignment> all;

  void Add(const Actions& actions) {
    for (GroupAssignment& group : HandedOut(actions)) {
      for (const Placement& placement : group.group.placements) ++boxes[placement.id];
      all.push_back(group);
      waiting.push_back(std::move(group));
    }
  }
};

class LeavingTest : public testing::Test {
 protected:
  LeavingTest() {
    for (PeerToken i = 1; i <= 4; ++i) script_.Join(10 + i, i);
  }
  // Keeps what was handed out.
  Actions See(Actions actions) {
    handed_.Add(actions);
    return actions;
  }
  // Answers the oldest group that is out.
  Actions AnswerOne() {
    const GroupAssignment group = handed_.waiting.front();
    handed_.waiting.erase(handed_.waiting.begin());
    return See(script_.Answer(group));
  }
  Actions AnswerRest() {
    Actions actions;
    while (!handed_.waiting.empty()) CoordinatorScript::Append(actions, AnswerOne());
    return actions;
  }
  std::set<PeerToken> Stopped(const Actions& actions) {
    std::set<PeerToken> stopped;
    for (const auto& stop : ToWorkers<Stop>(actions)) stopped.insert(stop.to);
    return stopped;
  }
  void ExpectEachBoxOnce() {
    EXPECT_FALSE(handed_.boxes.empty());
    for (const auto& [box, times] : handed_.boxes) EXPECT_EQ(times, 1) << "box " << box;
  }

  CoordinatorScript script_;
  Handed handed_;
};

TEST_F(LeavingTest, AnIdleWorkerIsStoppedAtOnce) {
  EXPECT_EQ(Stopped(script_.Leave(2)), std::set<PeerToken>{12});
  const StatusReply status = script_.QueryStatus();
  EXPECT_THAT(status.workers, SizeIs(3));
  EXPECT_EQ(status.workers_lost, 0U);
  // If the Stop is lost, the next heartbeat tells the worker that it is not known any more.
  EXPECT_THAT(ToWorkers<Retire>(script_.Beat({.token = 12, .incarnation = 2, .id = 2})), SizeIs(1));
}

class HalfLeavingTest : public LeavingTest, public testing::WithParamInterface<WorkerId> {};

TEST_P(HalfLeavingTest, NoBoxIsHandedOutTwice) {
  const WorkerId first = GetParam(), second = first % 4 + 1;
  See(script_.Submit(21, Frame(1, 8)));
  AnswerOne();
  EXPECT_THAT(Stopped(See(script_.Leave(first))), IsEmpty()) << "it has a part in groups that are out";
  EXPECT_THAT(Stopped(See(script_.Leave(second))), IsEmpty());
  const std::size_t before = handed_.all.size();
  const Actions actions = AnswerRest();
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  ExpectEachBoxOnce();
  ASSERT_GT(handed_.all.size(), before);
  for (std::size_t i = before; i < handed_.all.size(); ++i) {
    const std::set<WorkerId> workers = WorkersOf(handed_.all[i]);
    EXPECT_FALSE(workers.contains(first) || workers.contains(second)) << "group " << i;
    EXPECT_EQ(handed_.all[i].display, handed_.all[0].display) << "it holds what is accumulated";
    EXPECT_EQ(handed_.all[i].first_group, handed_.all[before].key.group);
  }
  EXPECT_EQ(Stopped(actions), (std::set<PeerToken>{10 + first, 10 + second}));
  EXPECT_EQ(script_.QueryStatus().workers_lost, 0U);
}

INSTANTIATE_TEST_SUITE_P(Any, HalfLeavingTest, testing::Values(1, 2, 3, 4));

TEST_F(LeavingTest, ADisplayWorkerThatIsLeavingIsTheLastToGo) {
  See(script_.Submit(21, Frame(1, 8)));
  const WorkerId display = handed_.waiting.front().display;
  AnswerOne();
  script_.Leave(display);
  while (handed_.waiting.front().key.group + 1 < handed_.waiting.front().group_count) EXPECT_THAT(Stopped(AnswerOne()), IsEmpty());
  const GroupAssignment last = handed_.waiting.front();
  EXPECT_FALSE(WorkersOf(last).contains(display));
  EXPECT_THAT(Stopped(script_.Done(last)), IsEmpty()) << "it makes the picture";
  EXPECT_EQ(Stopped(script_.Image(last, last.group_count)), std::set<PeerToken>{10 + display});
}

TEST_F(LeavingTest, AFrameThatHasNotBegunGetsAnotherDisplayWorker) {
  // The window is full of the first two frames; so the third one is only planned when a worker leaves.
  for (RequestId request = 1; request <= 3; ++request) See(script_.Submit(21, Frame(request, 8)));
  const WorkerId leaver = 3;
  script_.Leave(leaver);
  const std::size_t before = handed_.all.size();
  const Actions actions = AnswerRest();
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(3));
  for (std::size_t i = before; i < handed_.all.size(); ++i) {
    EXPECT_FALSE(WorkersOf(handed_.all[i]).contains(leaver));
    if (handed_.all[i].key.frame == 3) {
      EXPECT_NE(handed_.all[i].display, leaver);
    }
  }
}

TEST_F(LeavingTest, StatusTellsWhoIsLeaving) {
  See(script_.Submit(21, Frame(1, 8)));
  script_.Leave(2);
  const StatusReply status = script_.QueryStatus();
  ASSERT_THAT(status.workers, SizeIs(4));
  for (const WorkerStatus& worker : status.workers) EXPECT_EQ(worker.leaving, worker.worker == 2);
}

TEST_F(LeavingTest, WhenAllLeaveTheyFinishTheFramesThatRunAndTheOthersWaitForNewWorkers) {
  See(script_.Submit(21, Frame(1, 8)));
  AnswerOne();
  for (WorkerId worker = 1; worker <= 4; ++worker) See(script_.Leave(worker));
  See(script_.Submit(22, Frame(7, 2)));
  const Actions actions = AnswerRest();
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  EXPECT_THAT(Stopped(actions), SizeIs(4));
  ExpectEachBoxOnce();
  EXPECT_THAT(script_.QueryStatus().workers, IsEmpty());

  script_.workers.clear();
  EXPECT_THAT(ToClients<FrameFailed>(script_.Pass(seconds(60))), IsEmpty()) << "it was there when they left: it waits";
  See(script_.Submit(23, Frame(8)));
  const auto later = ToClients<FrameFailed>(script_.Pass(seconds(11)));
  ASSERT_THAT(later, SizeIs(1)) << "it came when nobody was there";
  EXPECT_EQ(later[0].to, 23U);

  Actions joined;
  script_.Join(31, 31, &joined);
  See(joined);
  const auto replies = ToClients<FrameReply>(AnswerRest());
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_EQ(replies[0].to, 22U);
}

TEST_F(LeavingTest, WhatIsLeftBehindFailsAtItsDeadlineAndSaysWhy) {
  script_.plans_at_once = false;  // it stays in the queue
  SubmitFrame submit = Frame(1);
  submit.deadline_ms = 20000;
  script_.Submit(21, submit);
  for (WorkerId worker = 1; worker <= 4; ++worker) script_.Leave(worker);
  script_.workers.clear();
  EXPECT_THAT(ToClients<FrameFailed>(script_.Pass(milliseconds(19999))), IsEmpty());
  const auto failed = ToClients<FrameFailed>(script_.Pass(milliseconds(1)));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(failed[0].message.status.message(), testing::HasSubstr("there was no worker"));
}

TEST_F(LeavingTest, AWorkerThatIsKilledWhileItLeavesIsALossLikeAnother) {
  See(script_.Submit(21, Frame(1, 8)));
  AnswerOne();
  const WorkerId leaver = handed_.all[0].display % 4 + 1;  // not the display worker
  script_.Leave(leaver);
  handed_.waiting.clear();
  See(script_.Kill(script_.WorkerOf(leaver)));
  ASSERT_FALSE(handed_.waiting.empty());
  EXPECT_EQ(handed_.waiting[0].key.attempt, 2U);
  EXPECT_THAT(ToClients<FrameReply>(AnswerRest()), SizeIs(1));
  EXPECT_EQ(script_.QueryStatus().workers_lost, 1U);
}

// The only worker that stays cannot do its part of the frame: those that are leaving do.
TEST_F(LeavingTest, AFrameIsNotHandedOverToAWorkerThatCannotRenderIt) {
  See(script_.Submit(21, Frame(1, 8)));
  const GroupAssignment first = handed_.waiting.front();
  const WorkerId unable = first.display % 4 + 1;
  handed_.waiting.clear();
  See(script_.Worker(
      script_.WorkerOf(unable),
      WorkerTrouble{.epoch = 77, .worker = unable, .key = first.key, .status = Status::ResourceExhausted("no memory"), .elsewhere = true}));
  for (WorkerId worker = 1; worker <= 4; ++worker) {
    if (worker != unable) See(script_.Leave(worker));
  }
  const Actions actions = AnswerRest();
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  EXPECT_THAT(Stopped(actions), SizeIs(3));
}

TEST_F(LeavingTest, AReplacementTakesTheSlotWhileTheOldWorkerIsStillThere) {
  See(script_.Submit(21, Frame(1, 8)));
  script_.Leave(2);
  script_.Join(31, 31);
  const StatusReply status = script_.QueryStatus();
  ASSERT_THAT(status.workers, SizeIs(5));
  EXPECT_EQ(status.workers[4].slot, 1U);
}

}  // namespace
}  // namespace slabstream
