// What the coordinator owes to clients: fair turns, answers that are not lost, limits, deadlines, and an end to every request.
#include "coordinator/frames/clients.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

// A service whose one worker is busy with a first frame of another client and one of kClient, so that what kClient asks for queues.
struct BusyScript : CoordinatorScript {
  BusyScript() {
    Join(11, 1);
    first = HandedOut(Submit(99, Frame(1, 2)));
    own = HandedOut(Submit(kClient, Frame(100)));
  }
  std::vector<GroupAssignment> first, own;
};

TEST(CoordinatorClients, ClientsAreServedInTurn) {
  BusyScript script;
  for (RequestId id = 1; id <= 4; ++id) EXPECT_THAT(HandedOut(script.Submit(kClient, Frame(id))), IsEmpty()) << "it has a frame";
  Actions actions = script.Submit(kOther, Frame(1));
  EXPECT_THAT(HandedOut(actions), SizeIs(1)) << "it has none";
  EXPECT_THAT(HandedOut(script.Submit(kOther, Frame(2))), IsEmpty());
  for (const GroupAssignment& group : script.first) CoordinatorScript::Append(actions, script.Answer(group));
  for (const GroupAssignment& group : script.own) CoordinatorScript::Append(actions, script.Answer(group));
  std::vector<std::pair<PeerToken, RequestId>> served;
  for (const auto& reply : ToClients<FrameReply>(script.AnswerAll(actions))) served.emplace_back(reply.to, reply.message.request);
  const std::vector<std::pair<PeerToken, RequestId>> expected = {{99, 1}, {21, 100}, {22, 1}, {21, 1}, {22, 2}, {21, 2}, {21, 3}, {21, 4}};
  EXPECT_EQ(served, expected);
}

TEST(CoordinatorClients, WhoAsksForHugeFramesHasOneUnderWayUntilOthersHadAsMuchTime) {
  CoordinatorScript script;
  script.Join(11, 1);
  constexpr int kHuge = 128;
  std::vector<GroupAssignment> groups;
  std::vector<PeerToken> served;
  const auto note = [&](const Actions& actions) {
    for (const auto& reply : ToClients<FrameReply>(actions)) served.push_back(reply.to);
    for (GroupAssignment& group : HandedOut(actions)) groups.push_back(std::move(group));
  };
  for (RequestId id = 1; id <= 4; ++id) {
    SubmitFrame huge = Frame(id);
    huge.frame.size = {kHuge, kHuge};
    note(script.Submit(kClient, huge));
  }
  for (RequestId id = 1; id <= 50; ++id) note(script.Submit(kOther, Frame(id)));
  const auto is_huge = [](const GroupAssignment& group) { return group.setup.camera.width == kHuge; };
  std::ptrdiff_t others = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const GroupAssignment group = groups[i];
    others += is_huge(group) ? 0 : 1;
    RankReport report{.worker = group.display};
    report.stage_ns[std::size_t(Stage::kRender)] = is_huge(group) ? 10'000'000'000 : 1'000'000'000;
    note(script.Done(group, {report}));
    note(script.Image(group, 1));
    // Two of them began before the other client asked. Then it is the other's turn for 20 s, but nobody is left without a frame.
    const std::ptrdiff_t under_way = std::count_if(groups.begin() + std::ptrdiff_t(i) + 1, groups.end(), is_huge);
    if (i >= 1 && others < 18) {
      EXPECT_LE(under_way, 1) << "after " << i + 1 << " frames";
    }
  }
  EXPECT_EQ(std::ranges::count(served, kClient), 4);
  EXPECT_EQ(std::ranges::count(served, kOther), 50);
}

TEST(CoordinatorClients, ProgressTellsPhasesAndPositions) {
  BusyScript script;
  script.Submit(kClient, Frame(1));
  const Actions queued = script.Submit(kClient, Frame(2));
  ASSERT_EQ(ToClients<FrameProgress>(queued).size(), 1U);
  EXPECT_EQ(ToClients<FrameProgress>(queued)[0].message,
            (FrameProgress{.request = 2, .phase = FramePhase::kQueued, .queue_position = 1, .workers = 1}));
  const Actions loading = script.Client(kOther, Frame(1, 1, "other"));
  ASSERT_EQ(ToClients<FrameProgress>(loading).size(), 1U);
  EXPECT_EQ(ToClients<FrameProgress>(loading)[0].message.phase, FramePhase::kLoading);
  const LoadId load = script.loads.back().load;
  const auto read = ToClients<FrameProgress>(script.Step(DatasetReading{"other", load, {40, 310 << 20}}));
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].to, kOther);
  EXPECT_EQ(read[0].message.phase, FramePhase::kLoading);
  EXPECT_EQ(read[0].message.read_percent, 40U);
  EXPECT_EQ(read[0].message.read_rate, std::uint64_t{310} << 20);
  EXPECT_THAT(ToClients<FrameProgress>(script.Step(DatasetReading{"other", load + 1, {50}})), testing::IsEmpty()) << "of another load";
  const auto loaded = ToClients<FrameProgress>(script.Step(DatasetLoaded{"other", load, 1, BlockSummary()}));
  ASSERT_EQ(loaded.size(), 2U) << "it begins at once";
  EXPECT_EQ(loaded[0].to, kOther);
  EXPECT_EQ(loaded[0].message.phase, FramePhase::kQueued);
  EXPECT_EQ(loaded[0].message.read_percent, 0U);
  const auto started = ToClients<FrameProgress>(script.Answer(script.own[0]));
  EXPECT_TRUE(std::any_of(started.begin(), started.end(), [](const auto& p) {
    return p.to == kClient &&
           p.message == FrameProgress{.request = 1, .phase = FramePhase::kRunning, .group_count = 1, .attempt = 1, .workers = 1};
  }));
}

TEST(CoordinatorClients, SubmitTwiceIsSubmitOnceAndTheAnswerIsKept) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1)));
  EXPECT_TRUE(script.Client(kClient, Frame(1)).empty()) << "running";
  script.Submit(kClient, Frame(2));
  const Bytes payload(std::vector<std::byte>(100));
  script.Done(groups[0]);
  script.Image(groups[0], 1, payload);
  const Actions again = script.Client(kClient, Frame(1));
  ASSERT_EQ(ToClients<FrameReply>(again).size(), 1U);
  EXPECT_EQ(ToClients<FrameReply>(again)[0].payload.span().data(), payload.span().data());
  EXPECT_TRUE(HandedOut(again).empty());
  EXPECT_FALSE(HandedOut(script.Client(kOther, Frame(1))).empty()) << "another client's request 1 is another request";
}

TEST(CoordinatorClients, KeptAnswersAreBoundedInBytes) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto big = std::make_shared<std::vector<std::byte>>(kMaxKeptAnswerBytes / 2 + 1);
  for (RequestId id = 1; id <= 2; ++id) {
    const auto groups = HandedOut(script.Submit(kClient, Frame(id)));
    script.Done(groups.at(0));
    script.Image(groups[0], 1, Bytes(big, *big));
  }
  const auto pong = ToClients<ClientPong>(script.Client(kClient, ClientPing{.nonce = 3, .open = {1, 2}}));
  ASSERT_EQ(pong.size(), 1U);
  EXPECT_THAT(pong[0].message.known, ElementsAre(2U));
}

TEST(CoordinatorClients, PongTellsWhatIsKnownAndLostAnswersAreSentAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1)));
  script.Answer(groups[0]);
  script.Submit(kClient, Frame(2));
  const ClientPing ping{.nonce = 3, .open = {1, 2, 3}};
  const Actions soon = script.Client(kClient, ping);
  EXPECT_EQ(ToClients<ClientPong>(soon).at(0).message, (ClientPong{.epoch = 77, .nonce = 3, .known = {1, 2}}));
  EXPECT_TRUE(ToClients<FrameReply>(soon).empty()) << "it is on its way";
  script.Pass(seconds(5));
  EXPECT_EQ(ToClients<FrameReply>(script.Client(kClient, ping)).size(), 1U);
  EXPECT_TRUE(ToClients<FrameReply>(script.Client(kClient, ping)).empty());
}

TEST(CoordinatorClients, UnknownDatasetIsRefusedWithTheNamesThereAre) {
  CoordinatorScript script;
  const auto failed = ToClients<FrameFailed>(script.Client(kClient, Frame(1, 1, "nonesuch")));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kNotFound);
  EXPECT_EQ(failed[0].message.status.message(), "no dataset \"nonesuch\": the catalogue has block, other");
  EXPECT_TRUE(script.loads.empty());
}

TEST(CoordinatorClients, FrameThatCannotBePlannedFailsAndTheNextOneRuns) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame bad = Frame(1);
  bad.frame.policy.decomposition = "nonesuch";
  const Actions actions = script.Submit(kClient, bad);
  ASSERT_EQ(ToClients<FrameFailed>(actions).size(), 1U);
  EXPECT_EQ(ToClients<FrameFailed>(actions)[0].message.status.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(script.Submit(kClient, Frame(2)))).size(), 1U);
}

TEST(CoordinatorClients, OpenRequestsOfAClientAreLimited) {
  BusyScript script;
  for (RequestId id = 1; id <= kMaxOpenRequests; ++id) ASSERT_TRUE(ToClients<FrameFailed>(script.Client(kClient, Frame(id))).empty());
  const auto failed = ToClients<FrameFailed>(script.Client(kClient, Frame(kMaxOpenRequests + 1)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("256"));
  EXPECT_TRUE(ToClients<FrameFailed>(script.Client(kOther, Frame(1))).empty()) << "others are not concerned";
}

TEST(CoordinatorClients, FramesOfAllClientsAreLimited) {
  ScriptConfig config = TestConfig();
  config.max_queued = 3;
  CoordinatorScript script(config);
  for (PeerToken client = 1; client <= 3; ++client) EXPECT_TRUE(ToClients<FrameFailed>(script.Client(client, Frame(1))).empty());
  const auto failed = ToClients<FrameFailed>(script.Client(4, Frame(1)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("3 frames are queued"));
}

TEST(CoordinatorClients, CancelEndsARequestWhereverItIs) {
  BusyScript script;
  script.Submit(kClient, Frame(1));
  const auto queued = ToClients<FrameFailed>(script.Client(kClient, CancelFrame{1}));
  ASSERT_EQ(queued.size(), 1U);
  EXPECT_EQ(queued[0].message.status.code(), StatusCode::kCancelled);
  EXPECT_EQ(script.QueryStatus().queued, 0U);

  // Running: the workers are told at once, and the next frame starts.
  script.Submit(kClient, Frame(2));
  const Actions running = script.Client(99, CancelFrame{1});
  EXPECT_EQ(ToClients<FrameFailed>(running).size(), 1U);
  EXPECT_EQ(ToWorkers<Ping>(running).at(0).message.finished_before, 2U);
  EXPECT_EQ(HandedOut(running).at(0).key.frame, 3U);

  // A SubmitFrame that its Cancel has overtaken ends cancelled as well.
  EXPECT_EQ(ToClients<FrameFailed>(script.Client(kClient, CancelFrame{7})).size(), 1U);
  const Actions late = script.Client(kClient, Frame(7));
  ASSERT_EQ(ToClients<FrameFailed>(late).size(), 1U);
  EXPECT_EQ(ToClients<FrameFailed>(late)[0].message.status.code(), StatusCode::kCancelled);
  EXPECT_EQ(script.QueryStatus().frames_failed, 0U) << "what was cancelled has not failed";
}

TEST(CoordinatorClients, ClientThatIsGoneFreesItsWork) {
  BusyScript script;
  script.Submit(99, Frame(2));
  script.Submit(kClient, Frame(1));
  const Actions actions = script.Step(ClientGone{99});
  EXPECT_EQ(ToWorkers<Ping>(actions).at(0).message.finished_before, 2U);
  EXPECT_EQ(HandedOut(actions).at(0).key.frame, 3U) << "the other client's frame starts";
  const StatusReply status = script.QueryStatus();
  EXPECT_EQ(status.queued, 0U);
  EXPECT_EQ(status.clients, 1U);
}

TEST(CoordinatorClients, SilentClientFreesItsWork) {
  BusyScript script;
  script.clients.clear();
  script.Pass(seconds(10) - Duration(1));
  EXPECT_EQ(script.QueryStatus().running, 2U);
  script.Pass(Duration(1));
  EXPECT_EQ(script.QueryStatus().running, 0U);
  EXPECT_EQ(script.QueryStatus().clients, 0U);
}

TEST(CoordinatorClients, DeadlineEndsQueuedAndRunningFrames) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame running = Frame(1, 2), queued = Frame(2);
  running.deadline_ms = 2000;
  queued.deadline_ms = 1500;
  script.Submit(kClient, running);
  script.Submit(kClient, queued);
  auto failed = ToClients<FrameFailed>(script.Pass(milliseconds(1500)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.request, 2U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("1500 ms: it was still queued"));
  failed = ToClients<FrameFailed>(script.Pass(milliseconds(500)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.request, 1U);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("2000 ms: 0 of 2 groups were done"));
}

TEST(CoordinatorClients, WithoutWorkersARequestWaitsAndThenFails) {
  CoordinatorScript script;
  script.Submit(kClient, Frame(1));
  EXPECT_EQ(script.machine.NextWake(), script.now + script.config.heartbeat);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Pass(seconds(10) - Duration(1))).empty());
  const auto failed = ToClients<FrameFailed>(script.Pass(Duration(1)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(failed[0].message.status.message(),
            "no worker registered within 10 s, at least one is needed; start one with slabstream-worker");
}

TEST(CoordinatorClients, DatasetIsLoadedOnceAndAFailedLoadIsTriedAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Client(kClient, Frame(1));
  script.Client(kClient, Frame(2));
  ASSERT_EQ(script.loads.size(), 1U);
  const auto failed =
      ToClients<FrameFailed>(script.Step(DatasetFailed{"block", script.loads.back().load, Status::DataLoss("block.nrrd: truncated")}));
  ASSERT_EQ(failed.size(), 2U);
  EXPECT_EQ(failed[0].message.status, Status::DataLoss("block.nrrd: truncated"));
  EXPECT_EQ(script.QueryStatus().datasets[0].error, "block.nrrd: truncated");

  script.Client(kClient, Frame(3));
  ASSERT_EQ(script.loads.size(), 2U);
  EXPECT_NE(script.loads[1].load, script.loads[0].load);
  EXPECT_TRUE(HandedOut(script.Step(DatasetLoaded{"block", script.loads[0].load, 1, BlockSummary()})).empty()) << "of the first load";
  EXPECT_EQ(HandedOut(script.Step(DatasetLoaded{"block", script.loads[1].load, 1, BlockSummary()})).size(), 1U);
  script.Client(kClient, Frame(4));
  EXPECT_EQ(script.loads.size(), 2U);
}

TEST(CoordinatorClients, StatusTellsWhatThereIs) {
  BusyScript script;
  script.Submit(kClient, Frame(1));
  script.workers[0].rendered_ranks = 3;
  script.Pass(milliseconds(1700));
  const StatusReply status = script.QueryStatus();
  EXPECT_EQ(status.epoch, 77U);
  EXPECT_EQ(status.nonce, 5U);
  EXPECT_EQ(status.pid, 4321U);
  EXPECT_EQ(status.uptime_ms, 1700U);
  EXPECT_EQ(status.clients, 2U) << "who only asks for the status is no client";
  EXPECT_EQ(status.queued, 1U);
  EXPECT_EQ(status.running, 2U);
  ASSERT_EQ(status.workers.size(), 1U);
  EXPECT_EQ(status.workers[0].host, "here");
  EXPECT_EQ(status.workers[0].rendered_ranks, 3U);
  EXPECT_EQ(status.workers[0].silent_ms, 200U);
  ASSERT_EQ(status.datasets.size(), 2U);
  EXPECT_EQ(status.datasets[0].state, DatasetState::kReady);
  EXPECT_EQ(status.datasets[0].description, BlockSummary()->description);
  EXPECT_EQ(status.datasets[1].state, DatasetState::kUnloaded);
}

TEST(CoordinatorClients, ShutDownTellsEverybodyAndEnds) {
  BusyScript script;
  script.Submit(kClient, Frame(1));
  const Actions actions = script.Client(kOther, ShutDown{.nonce = 8});
  EXPECT_EQ(ToClients<ShutDownReply>(actions).at(0).message.nonce, 8U);
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_EQ(failed.size(), 3U);
  EXPECT_EQ(failed[0].message.status, Status::Unavailable("the service was shut down"));
  EXPECT_EQ(ToWorkers<Stop>(actions).size(), 1U);
  ASSERT_FALSE(actions.empty());
  EXPECT_NE(Get<StopService>(actions.back()), nullptr);
  EXPECT_EQ(script.machine.NextWake(), Time::max());
  EXPECT_TRUE(script.Client(kClient, Frame(2)).empty());
}

TEST(CoordinatorClients, CoordinatorThatIsStoppedLetsItsWorkersWaitForAnother) {
  BusyScript script;
  const Actions actions = script.Step(CoordinatorStopRequested{});
  EXPECT_EQ(ToClients<FrameFailed>(actions).size(), 2U);
  EXPECT_EQ(ToWorkers<Retire>(actions).size(), 1U);
  EXPECT_TRUE(ToWorkers<Stop>(actions).empty());
  EXPECT_EQ(Of<StopService>(actions).size(), 1U);
}

}  // namespace
}  // namespace slabstream
