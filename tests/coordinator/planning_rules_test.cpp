// What the machine does while plans are made elsewhere: it goes on, plans ahead, and drops what nobody waits for any more.
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

// Plans wait until the test makes them.
struct SlowPlanner : CoordinatorScript {
  SlowPlanner() {
    plans_at_once = false;
    worker = Join(11, 1);
  }
  FakeWorker worker;
};

TEST(CoordinatorPlanning, EverybodyIsAnsweredWhileAPlanIsMade) {
  SlowPlanner script;
  script.Submit(kClient, Frame(1));
  ASSERT_THAT(script.plans, SizeIs(1));
  EXPECT_THAT(ToWorkers<Ping>(script.Beat(script.worker)), SizeIs(1));
  EXPECT_THAT(ToClients<ClientPong>(script.Client(kClient, ClientPing{.nonce = 1, .open = {1}})).at(0).message.known, SizeIs(1));
  const Actions meanwhile = script.Pass(seconds(60));
  EXPECT_TRUE(ToClients<FrameFailed>(meanwhile).empty());
  EXPECT_EQ(script.QueryStatus().workers_lost, 0U);
  EXPECT_EQ(script.QueryStatus().queued, 1U);
  EXPECT_THAT(HandedOut(script.Plan()), SizeIs(1));
}

TEST(CoordinatorPlanning, TheNextFrameStartsInTheMomentInWhichThereIsRoom) {
  SlowPlanner script;
  Actions actions;
  for (RequestId id = 1; id <= 10; ++id) CoordinatorScript::Append(actions, script.Submit(kClient, Frame(id)));
  std::size_t pictures = 0;
  while (!script.plans.empty()) CoordinatorScript::Append(actions, script.Plan());
  std::vector<GroupAssignment> groups = HandedOut(actions);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Actions end = script.Answer(groups[i]);
    pictures += ToClients<FrameReply>(end).size();
    std::vector<GroupAssignment> started = HandedOut(end);
    if (groups[i].key.frame + 2 <= 10) {
      ASSERT_THAT(started, SizeIs(1)) << "its plan was there";
    }
    groups.insert(groups.end(), started.begin(), started.end());
    while (!script.plans.empty()) EXPECT_TRUE(HandedOut(script.Plan()).empty());
  }
  EXPECT_EQ(pictures, 10U);
}

TEST(CoordinatorPlanning, OnlyWhatStartsSoonIsPlanned) {
  SlowPlanner script;
  for (RequestId id = 1; id <= 20; ++id) script.Submit(kClient, Frame(id));
  EXPECT_LT(script.plans.size(), 5U);
}

TEST(CoordinatorPlanning, RequestThatEndsMeanwhileIsDropped) {
  SlowPlanner script;
  script.Submit(kClient, Frame(1));
  script.Submit(kOther, Frame(1));
  ASSERT_THAT(script.plans, SizeIs(2));
  const PlanRequest first = script.plans[0], second = script.plans[1];
  const Actions cancelled = script.Client(kClient, CancelFrame{1});
  ASSERT_THAT(Of<DropPlan>(cancelled), SizeIs(1));
  EXPECT_EQ(Of<DropPlan>(cancelled)[0].plan, first.plan);
  EXPECT_THAT(ToClients<FrameFailed>(cancelled), SizeIs(1));
  const Actions gone = script.Step(ClientGone{kOther});
  ASSERT_THAT(Of<DropPlan>(gone), SizeIs(1));
  EXPECT_EQ(Of<DropPlan>(gone)[0].plan, second.plan);
  for (const PlanRequest& request : {first, second}) {
    EXPECT_TRUE(script.Step(Planned{request.plan, script.planner.Plan(request)}).empty()) << "it had begun already";
  }
  EXPECT_EQ(script.QueryStatus().queued, 0U);
  EXPECT_EQ(script.QueryStatus().running, 0U);
}

TEST(CoordinatorPlanning, FailedPlanFailsThatFrameOnly) {
  SlowPlanner script;
  script.Submit(kClient, Frame(1));
  script.Submit(kClient, Frame(2));
  ASSERT_THAT(script.plans, SizeIs(2));
  const PlanRequest first = script.plans[0];
  script.plans.erase(script.plans.begin());
  const auto failed = ToClients<FrameFailed>(script.Step(Planned{first.plan, Status::ResourceExhausted("planning: not enough memory")}));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.request, 1U);
  EXPECT_EQ(failed[0].message.status, Status::ResourceExhausted("planning: not enough memory"));
  EXPECT_EQ(HandedOut(script.Plan()).at(0).key.frame, 1U) << "the first frame that started";
}

TEST(CoordinatorPlanning, PlanForOtherWorkersIsMadeAgain) {
  SlowPlanner script;
  script.Submit(kClient, Frame(1));
  const auto resolved = script.plans.at(0).resolved;
  script.Join(12, 2);
  ASSERT_THAT(script.plans, SizeIs(1)) << "the first one is dropped";
  EXPECT_EQ(script.plans[0].resolved, resolved) << "a request is resolved once, however often it is planned";
  const auto groups = HandedOut(script.Plan());
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_THAT(WorkersOf(groups[0]), SizeIs(2));
}

TEST(CoordinatorPlanning, DeadlineEndsAFrameThatIsBeingPlanned) {
  SlowPlanner script;
  SubmitFrame submit = Frame(1);
  submit.deadline_ms = 1500;
  script.Submit(kClient, submit);
  const auto failed = ToClients<FrameFailed>(script.Pass(milliseconds(1500)));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("being planned"));
  EXPECT_TRUE(script.plans.empty());
}

}  // namespace
}  // namespace slabstream
