// How frames run: the window of groups, what ends a frame, and what is done about losses, stalls and trouble.
#include <map>

#include "common/planning/frame_window.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

TEST(CoordinatorFrames, FrameRunsGroupByGroupToItsPicture) {
  CoordinatorScript script;
  const FakeWorker a = script.Join(11, 1), b = script.Join(12, 2);
  const Actions start = script.Submit(kClient, Frame(1, 3));

  // Two groups go out, to both workers, with all that they need.
  const auto groups = HandedOut(start);
  ASSERT_THAT(Keys(groups), ElementsAre(GroupKey{1, 1, 0}, GroupKey{1, 1, 1}));
  EXPECT_EQ(ToWorkers<GroupAssignment>(start).size(), 4U);
  EXPECT_EQ(groups[0].epoch, 77U);
  EXPECT_EQ(groups[0].group_count, 3U);
  EXPECT_EQ(groups[0].first_group, 0U);
  EXPECT_EQ(WorkersOf(groups[0]), (std::set<WorkerId>{a.id, b.id}));
  EXPECT_EQ(groups[0].setup.dataset, script.loads.at(0).load);
  std::set<std::string> endpoints;
  for (const Peer& peer : groups[0].peers) endpoints.insert(peer.images_endpoint);
  EXPECT_EQ(endpoints, (std::set<std::string>{"inproc://images1", "inproc://images2"}));

  // Each group that is done makes room for the next; told twice, it changes nothing.
  EXPECT_THAT(Keys(HandedOut(script.Done(groups[0], {RankReport{.group = 0}}))), ElementsAre(GroupKey{1, 1, 2}));
  EXPECT_TRUE(script.Done(groups[0], {RankReport{.group = 0}}).empty());
  const auto progress = ToClients<FrameProgress>(script.Done(groups[1], {RankReport{.group = 1}}));
  ASSERT_EQ(progress.size(), 1U);
  EXPECT_EQ(progress[0].message.groups_done, 2U);
  EXPECT_EQ(progress[0].message.group_count, 3U);
  GroupAssignment last = groups[1];
  last.key.group = 2;
  script.now += seconds(2);
  EXPECT_TRUE(ToClients<FrameReply>(script.Done(last)).empty()) << "the picture is not here yet";

  const Bytes payload(std::vector<std::byte>(8));
  const Actions end = script.Image(last, 3, payload);
  const auto replies = ToClients<FrameReply>(end);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].to, kClient);
  EXPECT_EQ(replies[0].payload.span().data(), payload.span().data()) << "not a copy";
  const FrameStatistics& statistics = replies[0].message.statistics;
  EXPECT_EQ(statistics.renderer, "splat") << "which the request leaves to the service";
  EXPECT_EQ(statistics.workers, 2U);
  EXPECT_EQ(statistics.groups, 3U);
  EXPECT_EQ(statistics.attempts, 1U);
  EXPECT_EQ(statistics.axis, "z");
  EXPECT_EQ(statistics.combine, "fan-in");
  EXPECT_EQ(statistics.reports.size(), 2U);
  EXPECT_EQ(statistics.end_ns - statistics.begin_ns, Duration(seconds(2)).count());
  const auto pings = ToWorkers<Ping>(end);
  ASSERT_EQ(pings.size(), 2U) << "workers may forget the frame";
  EXPECT_EQ(pings[0].message.finished_before, 2U);
  EXPECT_TRUE(ToClients<FrameReply>(script.Image(last, 3)).empty()) << "a late copy";
}

// Also those that have no box in the first group.
TEST(CoordinatorFrames, AllWorkersHearWhoDrawsTilesOfShapes) {
  CoordinatorScript script;
  std::vector<FakeWorker> workers;
  for (PeerToken token = 11; token < 14; ++token) workers.push_back(script.Join(token, token));
  WorkerId other = 0;
  std::vector<TileOrder> orders;
  script.alter_plan = [&](FramePlan& plan) {
    GroupPlan& first = plan.groups.front();
    const auto at = std::ranges::find_if(first.placements, [&](const Placement& each) { return each.worker != plan.display; });
    other = at->worker;
    first.placements.erase(at);
    first.schedule = {"fan-in", Rank(first.placements.size()), {0}};
    plan.setup.shapes.resize(1);
    orders = plan.tiles = {{other, plan.display, {0}}, {plan.display, other, {1, 2}}};
  };
  const Actions start = script.Submit(kClient, Frame(1, 2));
  const auto groups = HandedOut(start);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].tiles, orders);
  EXPECT_FALSE(WorkersOf(groups[0]).contains(other));
  ASSERT_THAT(groups[0].others, SizeIs(1));
  EXPECT_EQ(groups[0].others[0].worker, other);
  EXPECT_THAT(groups[0].others[0].images_endpoint, testing::HasSubstr("inproc://images"));
  std::size_t copies = 0;
  for (const auto& sent : ToWorkers<GroupAssignment>(start)) copies += sent.message.key.group == 0 ? 1 : 0;
  EXPECT_EQ(copies, 3U);
  EXPECT_TRUE(groups[1].tiles.empty() && groups[1].others.empty());

  script.alter_plan = nullptr;
  const auto again = HandedOut(script.Kill(script.WorkerOf(other)));
  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].key.attempt, 2U);
  EXPECT_TRUE(again[0].tiles.empty()) << "nobody knows what was lost";
}

TEST(CoordinatorFrames, WindowSpansFramesAndTwoFramesRunAtMost) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 2)));
  ASSERT_THAT(Keys(first), ElementsAre(GroupKey{1, 1, 0}, GroupKey{1, 1, 1}));
  EXPECT_TRUE(HandedOut(script.Submit(kClient, Frame(2, 2))).empty()) << "the window is full";
  script.Submit(kClient, Frame(3, 2));

  // The next frame's first group goes out while the last one's final group is unfinished.
  const auto second = HandedOut(script.Done(first[0]));
  EXPECT_THAT(Keys(second), ElementsAre(GroupKey{2, 1, 0}));
  const auto more = HandedOut(script.Done(first[1]));
  EXPECT_THAT(Keys(more), ElementsAre(GroupKey{2, 1, 1}));
  // Frame 2 is through as well, but the pictures are missing: a third frame would be one too many.
  script.Done(second[0]);
  EXPECT_TRUE(HandedOut(script.Done(more[0])).empty());
  // The younger frame's picture comes first: its id is over though the watermark is behind it.
  const Actions end = script.Image(more[0], 2);
  EXPECT_THAT(Keys(HandedOut(end)), ElementsAre(GroupKey{3, 1, 0}, GroupKey{3, 1, 1}));
  EXPECT_EQ(ToWorkers<Ping>(end)[0].message.finished_before, 1U);
  EXPECT_THAT(ToWorkers<Ping>(end)[0].message.cancelled, ElementsAre(2U));
  EXPECT_EQ(HandedOut(end)[0].finished_before, 1U);
}

TEST(CoordinatorFrames, WindowHoldsForAnyNumberOfGroupsAndFrames) {
  CoordinatorScript script;
  for (PeerToken token = 1; token <= 3; ++token) script.Join(token, token);
  Actions actions;
  for (RequestId id = 1; id <= 6; ++id) CoordinatorScript::Append(actions, script.Submit(kClient, Frame(id, int(id))));
  std::vector<GroupAssignment> out = HandedOut(actions);
  std::size_t handed_out = out.size(), answered = 0, pictures = 0;
  while (answered < out.size()) {
    EXPECT_LE(handed_out - answered, std::size_t(WindowFor(3, 1, 0).groups));
    for (FrameId frame = 1; frame <= 6; ++frame) {
      EXPECT_LE(std::count_if(out.begin() + std::ptrdiff_t(answered), out.end(), [&](auto& group) { return group.key.frame == frame; }),
                kMaskedGroups);
    }
    const Actions more = script.Answer(out[answered++]);
    pictures += ToClients<FrameReply>(more).size();
    for (auto& group : HandedOut(more)) out.push_back(std::move(group));
    handed_out = out.size();
  }
  EXPECT_EQ(pictures, 6U);
  EXPECT_EQ(out.size(), 21U);
  std::map<FrameId, std::uint32_t> next;
  for (const GroupAssignment& group : out) EXPECT_EQ(group.key.group, next[group.key.frame]++) << "in order of groups";
}

TEST(CoordinatorFrames, MoreWorkersHaveMoreFramesUnderWay) {
  for (const int workers : {1, 2, 5, 40}) {
    CoordinatorScript script;
    for (int token = 1; token <= workers; ++token) script.Join(PeerToken(token), std::uint32_t(token));
    Actions actions;
    for (RequestId id = 1; id <= 50; ++id) CoordinatorScript::Append(actions, script.Submit(kClient, Frame(id)));
    EXPECT_EQ(HandedOut(actions).size(), std::size_t(WindowFor(std::size_t(workers), 1, 0).groups)) << workers << " workers";
  }
}

TEST(CoordinatorFrames, DisplayWorkersTakeTurnsAndKeepTheirFrame) {
  CoordinatorScript script;
  for (PeerToken token = 1; token <= 4; ++token) script.Join(token, std::uint32_t(token));
  std::vector<WorkerId> displays;
  for (RequestId id = 1; id <= 8; ++id) {
    const auto groups = HandedOut(script.AnswerAll(script.Submit(kClient, Frame(id, 3))));
    ASSERT_EQ(groups.size(), 3U);
    displays.push_back(groups[0].display);
    for (const GroupAssignment& group : groups) EXPECT_EQ(group.display, displays.back());
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(displays[i], displays[i + 4]);
  EXPECT_EQ(std::set<WorkerId>(displays.begin(), displays.end()).size(), 4U) << "everybody has a turn";
}

TEST(CoordinatorFrames, LossIsPlannedAroundFromTheFirstUnfinishedGroup) {
  CoordinatorScript script;
  for (PeerToken token = 1; token <= 3; ++token) script.Join(token, token);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 4)));
  script.Done(groups[0]);
  const FakeWorker lost =
      *std::find_if(script.workers.begin(), script.workers.end(), [&](const FakeWorker& w) { return w.id != groups[0].display; });

  const Actions actions = script.Kill(lost);
  const auto again = HandedOut(actions);
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 1}, GroupKey{1, 2, 2}));
  EXPECT_EQ(again[0].first_group, 1U);
  EXPECT_EQ(again[0].display, groups[0].display);
  EXPECT_EQ(again[0].setup, groups[0].setup) << "what fixes the picture stays";
  EXPECT_EQ(again[0].group.placements.size(), groups[1].group.placements.size());
  EXPECT_FALSE(WorkersOf(again[0]).contains(lost.id));
  EXPECT_EQ(ToClients<FrameProgress>(actions).at(0).message.attempt, 2U);
  const auto replies = ToClients<FrameReply>(script.AnswerAll(actions));
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].message.statistics.attempts, 2U);
}

// Two workers and a frame of so many groups, the first of which is done.
struct FirstGroupDone : CoordinatorScript {
  explicit FirstGroupDone(int group_count) {
    Join(11, 1);
    Join(12, 2);
    groups = HandedOut(Submit(kClient, Frame(1, group_count)));
    Done(groups[0]);
  }
  std::vector<GroupAssignment> groups;  // as they were handed out
};

TEST(CoordinatorFrames, LossOfTheDisplayWorkerBeginsAgain) {
  FirstGroupDone script(3);
  const std::vector<GroupAssignment>& groups = script.groups;
  const auto again = HandedOut(script.Kill(script.WorkerOf(groups[0].display)));
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 0}, GroupKey{1, 2, 1}));
  EXPECT_EQ(again[0].first_group, 0U);
  EXPECT_NE(again[0].display, groups[0].display);
  // What the lost display worker said before it went is about a picture that is gone.
  EXPECT_TRUE(
      script.Step(FromWorker{script.tokens.at(groups[1].display), GroupDone{77, groups[1].display, groups[1].key, {}}, {}}).empty());
}

TEST(CoordinatorFrames, LossOfAWorkerThatHasDoneItsPartCostsNothing) {
  FirstGroupDone script(1);
  const std::vector<GroupAssignment>& groups = script.groups;
  const FakeWorker other =
      *std::find_if(script.workers.begin(), script.workers.end(), [&](const FakeWorker& w) { return w.id != groups[0].display; });
  EXPECT_TRUE(HandedOut(script.Kill(other)).empty());
  EXPECT_EQ(ToClients<FrameReply>(script.Image(groups[0], 1)).at(0).message.statistics.attempts, 1U);
}

TEST(CoordinatorFrames, NewsOfOlderAttemptsCountsIfItsSenderProvesIt) {
  CoordinatorScript script;
  for (PeerToken token = 1; token <= 3; ++token) script.Join(token, token);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 3)));
  const FakeWorker lost =
      *std::find_if(script.workers.begin(), script.workers.end(), [&](const FakeWorker& w) { return w.id != groups[0].display; });
  const auto again = HandedOut(script.Kill(lost));
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 2, 0}));

  const FakeWorker other =
      *std::find_if(script.workers.begin(), script.workers.end(), [&](const FakeWorker& w) { return w.id != groups[0].display; });
  EXPECT_TRUE(script.Worker(other, GroupDone{77, other.id, groups[0].key, {}}).empty()) << "not the display worker";
  EXPECT_TRUE(script.Worker(other, GroupDone{77, again[0].display, {1, 9, 0}, {}}).empty()) << "an attempt that never was";
  // Accumulated is accumulated: the third group goes out.
  EXPECT_THAT(Keys(HandedOut(script.Done(groups[0]))), ElementsAre(GroupKey{1, 2, 2}));
  EXPECT_TRUE(
      ToClients<FrameReply>(script.Step(FromWorker{script.tokens.at(other.id), FrameImage{77, other.id, 1, 1, 3, 3, {}, {}}, {}})).empty());
  EXPECT_EQ(ToClients<FrameReply>(script.Image(groups[0], 3)).size(), 1U) << "a whole picture is one, whatever was tried since";
}

TEST(CoordinatorFrames, PictureOfALostDisplayWorkerStillCounts) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
  const auto again = HandedOut(script.Kill(script.WorkerOf(groups[0].display)));
  const Actions end = script.Image(groups[0], 2);
  EXPECT_EQ(ToClients<FrameReply>(end).size(), 1U);
  EXPECT_EQ(ToWorkers<Ping>(end).at(0).message.finished_before, 2U) << "the attempt under way is called off";
  EXPECT_TRUE(script.Answer(again[0]).empty());
}

TEST(CoordinatorFrames, WorkersAreToldInWhichCodesThePictureMayCome) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = Frame(1, 1);
  submit.frame.straight8 = true;
  submit.frame.straight8_over = {1, 0.5F, 0};
  const GroupAssignment assignment = HandedOut(script.Submit(kClient, submit)).at(0);
  EXPECT_TRUE(assignment.straight8);
  EXPECT_EQ(assignment.straight8_over, submit.frame.straight8_over);
}

TEST(CoordinatorFrames, PreviewsGoToTheClientInOrderAndTellOfGroupsDone) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = Frame(1, 3);
  submit.frame.previews = true;
  const auto groups = HandedOut(script.Submit(kClient, submit));
  EXPECT_TRUE(groups.at(0).previews);
  const Actions second = script.Image(groups[0], 2);
  ASSERT_EQ(ToClients<FrameReply>(second).size(), 1U);
  EXPECT_EQ(ToClients<FrameReply>(second)[0].message.groups_done, 2U);
  EXPECT_EQ(ToClients<FrameReply>(second)[0].message.statistics, FrameStatistics{});
  EXPECT_THAT(Keys(HandedOut(second)), ElementsAre(GroupKey{1, 1, 2}));
  EXPECT_TRUE(ToClients<FrameReply>(script.Image(groups[0], 1)).empty()) << "the client has a better one";
}

TEST(CoordinatorFrames, FrameWithoutProgressIsHandedOutAgainAndFailsInTheEnd) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = Frame(1, 2);
  submit.deadline_ms = 24 * 3600 * 1000;
  script.Submit(kClient, submit);
  EXPECT_TRUE(HandedOut(script.Pass(seconds(60) - Duration(1))).empty());
  EXPECT_THAT(Keys(HandedOut(script.Pass(Duration(1)))), ElementsAre(GroupKey{1, 2, 0}, GroupKey{1, 2, 1}));
  EXPECT_TRUE(ToClients<FrameFailed>(script.Pass(seconds(4 * 60) - Duration(1))).empty());
  const auto failed = ToClients<FrameFailed>(script.Pass(Duration(1)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("no progress for 60 s (0 of 2 groups were done at attempt 5"));
}

TEST(CoordinatorFrames, OnlyGroupsNeverFinishedBeforeResetTheCountOfStalls) {
  CoordinatorScript script;
  script.Join(11, 1);
  SubmitFrame submit = Frame(1, 3);
  submit.deadline_ms = 24 * 3600 * 1000;
  auto groups = HandedOut(script.Submit(kClient, submit));
  for (int i = 0; i < 4; ++i) groups = HandedOut(script.Pass(seconds(60)));
  ASSERT_EQ(groups.at(0).key, (GroupKey{1, 5, 0}));
  script.Done(groups[0]);  // new ground
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(HandedOut(script.Pass(seconds(60))).at(0).key, (GroupKey{1, std::uint32_t(6 + i), 1}));
  }
  EXPECT_EQ(ToClients<FrameFailed>(script.Pass(seconds(60))).size(), 1U);
}

TEST(CoordinatorFrames, LongRenderingIsNoStall) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Submit(kClient, Frame(1, 1));
  for (int minute = 0; minute < 5; ++minute) {
    script.workers[0].rendered_ranks += 1;
    EXPECT_TRUE(HandedOut(script.Pass(seconds(59))).empty());
  }
}

TEST(CoordinatorFrames, RenderingOfLaterFramesDoesNotHideTheStallOfAnEarlierOne) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto first = HandedOut(script.Submit(kClient, Frame(1, 1)));
  const auto second = HandedOut(script.Submit(kClient, Frame(2, 1)));
  script.Answer(second.at(0));
  Actions actions;
  for (int i = 0; i < 6; ++i) {
    script.workers[0].rendered_ranks += 1;
    CoordinatorScript::Append(actions, script.Pass(seconds(10)));
  }
  EXPECT_THAT(Keys(HandedOut(actions)), ElementsAre(GroupKey{1, 2, 0}));
}

TEST(CoordinatorFrames, MissingPictureIsAskedForAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
  script.Done(groups[0]);
  script.Done(groups[1]);
  const auto again = HandedOut(script.Pass(seconds(60)));
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 1}));
  EXPECT_EQ(again[0].first_group, 1U) << "the display worker has what is before it";
  EXPECT_EQ(ToClients<FrameReply>(script.Answer(again[0])).size(), 1U);
}

TEST(CoordinatorFrames, TroubleIsTriedAgainWithPausesAndThenReported) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  auto groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
  const auto trouble = [&](const GroupAssignment& group, WorkerId worker) {
    return script.Worker(script.WorkerOf(worker),
                         WorkerTrouble{77, worker, group.key, 0, Status::ResourceExhausted("padded box of 9 GB, budget 1 GB")});
  };
  const WorkerId display = groups.at(0).display;
  const WorkerId other = display == 1 ? 2 : 1;
  groups = HandedOut(trouble(groups[0], other));
  ASSERT_EQ(groups.at(0).key, (GroupKey{1, 2, 0})) << "at once";
  EXPECT_TRUE(HandedOut(trouble(groups[0], other)).empty()) << "after a pause";
  for (int attempt = 3; attempt <= 5; ++attempt) {
    EXPECT_TRUE(HandedOut(script.Pass(milliseconds(500 * (attempt - 2)) - Duration(1))).empty());
    groups = HandedOut(script.Pass(Duration(1)));
    ASSERT_EQ(groups.at(0).key, (GroupKey{1, std::uint32_t(attempt), 0}));
    GroupAssignment stale = groups[0];
    stale.key.attempt = 1;
    EXPECT_TRUE(ToClients<FrameFailed>(trouble(stale, other)).empty());
    const Actions actions = trouble(groups[0], other);
    EXPECT_EQ(ToClients<FrameFailed>(actions).size(), attempt == 5 ? 1U : 0U);
    if (attempt == 5) {
      const Status status = ToClients<FrameFailed>(actions)[0].message.status;
      EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
      EXPECT_THAT(status.message(), HasSubstr("worker " + std::to_string(other) + ": padded box of 9 GB, budget 1 GB"));
    }
  }
  EXPECT_EQ(script.QueryStatus().running, 0U);
}

TEST(CoordinatorFrames, TroubleOfTheDisplayWorkerBeginsAgain) {
  CoordinatorScript script;
  script.Join(11, 1);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 3)));
  script.Done(groups[0]);
  const auto again =
      HandedOut(script.Worker(script.WorkerOf(groups[0].display), WorkerTrouble{77, groups[0].display, groups[1].key, 0,
                                                                                Status::DataLoss("0 groups accumulated, expected 1")}));
  ASSERT_THAT(Keys(again), ElementsAre(GroupKey{1, 2, 0}, GroupKey{1, 2, 1}));
  EXPECT_EQ(again[0].first_group, 0U);
  EXPECT_TRUE(script.Done(groups[1]).empty()) << "said before the trouble";
}

WorkerTrouble Unable(const GroupAssignment& group, WorkerId worker) {
  return {
      .epoch = 77, .worker = worker, .key = group.key, .status = Status::ResourceExhausted("render: not enough memory"), .elsewhere = true};
}

TEST(CoordinatorFrames, WorkerThatIsUnableIsLeftOutAtOnceAndOnlyOfThisFrame) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  script.Join(13, 3);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 3)));
  script.Done(groups.at(0));
  const WorkerId unable = groups[0].display % 3 + 1;
  const Actions actions = script.Worker(script.WorkerOf(unable), Unable(groups[1], unable));
  const auto again = HandedOut(actions);
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 2, 1}));
  EXPECT_FALSE(WorkersOf(again[0]).contains(unable));
  EXPECT_EQ(WorkersOf(again[0]).size(), 2U);
  EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(actions)).size(), 1U);
  EXPECT_EQ(WorkersOf(HandedOut(script.Submit(kClient, Frame(2))).at(0)).size(), 3U);
}

TEST(CoordinatorFrames, FrameThatNoWorkerIsAbleToRenderFailsAtOnceWithTheReason) {
  for (const int workers : {1, 2, 3}) {
    CoordinatorScript script;
    for (int token = 1; token <= workers; ++token) script.Join(PeerToken(token), std::uint32_t(token));
    Actions actions = script.Submit(kClient, Frame(1, 2));
    for (int i = 1; i < workers; ++i) {
      const GroupAssignment group = HandedOut(actions).at(0);
      actions = script.Worker(script.WorkerOf(*WorkersOf(group).begin()), Unable(group, *WorkersOf(group).begin()));
      EXPECT_TRUE(ToClients<FrameFailed>(actions).empty());
    }
    const GroupAssignment last = HandedOut(actions).at(0);
    const auto failed = ToClients<FrameFailed>(script.Worker(script.WorkerOf(last.display), Unable(last, last.display)));
    ASSERT_EQ(failed.size(), 1U) << workers << " workers";
    EXPECT_EQ(failed[0].message.status.code(), StatusCode::kResourceExhausted);
    EXPECT_EQ(failed[0].message.status.message(), "worker " + std::to_string(last.display) + ": render: not enough memory");
    EXPECT_EQ(script.QueryStatus().running, 0U);
  }
}

TEST(CoordinatorFrames, PictureThatTheDisplayWorkerCannotMakeIsMadeByAnother) {
  CoordinatorScript script;
  script.Join(11, 1);
  script.Join(12, 2);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
  script.Done(groups.at(0));
  script.Done(groups.at(1));
  const Actions actions = script.Worker(script.WorkerOf(groups[1].display), Unable(groups[1], groups[1].display));
  const auto again = HandedOut(actions);
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 2, 0})) << "what it accumulated is its own";
  EXPECT_NE(again[0].display, groups[0].display);
  EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(actions)).size(), 1U);
}

class UnreachablePeer : public testing::Test {
 protected:
  void SetUp() override {
    script.Join(11, 1);
    script.Join(12, 2);
    groups = HandedOut(script.Submit(kClient, Frame(1, 2)));
    accuser = script.WorkerOf(groups.at(0).display);
    accused = script.WorkerOf(accuser.id == 1 ? 2 : 1);
    complaint = script.Worker(accuser, WorkerTrouble{77, accuser.id, groups[0].key, accused.id, Status::Unavailable("does not answer")});
  }
  CoordinatorScript script;
  std::vector<GroupAssignment> groups;
  FakeWorker accuser, accused;
  Actions complaint;
};

TEST_F(UnreachablePeer, IsNotBelievedDeadButPinged) {
  EXPECT_TRUE(HandedOut(complaint).empty());
  ASSERT_EQ(ToWorkers<Ping>(complaint).size(), 1U);
  EXPECT_EQ(ToWorkers<Ping>(complaint)[0].to, accused.token);
}

TEST_F(UnreachablePeer, ThatIsDeadIsPlannedAround) {
  const auto again = HandedOut(script.Kill(accused));
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 2, 0}));
  EXPECT_EQ(WorkersOf(again[0]), std::set<WorkerId>{accuser.id});
  EXPECT_TRUE(HandedOut(script.Pass(seconds(10))).empty()) << "the suspicion is settled";
}

TEST_F(UnreachablePeer, ThatIsSilentIsPlannedAroundWithinTheTimeout) {
  script.Mute(accused);
  const auto again = HandedOut(script.Pass(seconds(6)));
  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].key.attempt, 2U);
  EXPECT_EQ(WorkersOf(again.back()), std::set<WorkerId>{accuser.id});
}

TEST_F(UnreachablePeer, ThatLivesIsTriedOnceMoreThenLeftOutOfTheFrame) {
  auto again = HandedOut(script.Pass(milliseconds(1000)));
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 2, 0}));
  EXPECT_EQ(WorkersOf(again[0]), (std::set<WorkerId>{accuser.id, accused.id})) << "the connection is made anew";
  script.Worker(accuser, WorkerTrouble{77, accuser.id, again[0].key, accused.id, Status::Unavailable("does not answer")});
  const Actions actions = script.Pass(milliseconds(1000));
  again = HandedOut(actions);
  ASSERT_EQ(again.at(0).key, (GroupKey{1, 3, 0}));
  EXPECT_EQ(again[0].display, groups[0].display) << "it keeps what it accumulated";
  EXPECT_EQ(WorkersOf(again[0]), (std::set<WorkerId>{accuser.id}));
  EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(actions)).size(), 1U);
  EXPECT_EQ(WorkersOf(HandedOut(script.Submit(kClient, Frame(2))).at(0)).size(), 2U) << "the next frame tries again";
}

// It complains of one worker after another: then it is the one that is cut off.
TEST(CoordinatorFrames, WorkerThatReachesNobodyIsLeftOutOfTheFrame) {
  CoordinatorScript script;
  for (int token = 11; token <= 14; ++token) script.Join(PeerToken(token), std::uint32_t(token));
  GroupAssignment group = HandedOut(script.Submit(kClient, Frame(1))).at(0);
  const WorkerId accuser = group.display % 4 + 1;
  std::set<WorkerId> others = WorkersOf(group);
  others.erase(accuser);
  others.erase(group.display);
  ASSERT_EQ(others.size(), 2U);
  for (const WorkerId accused : others) {
    EXPECT_EQ(WorkersOf(group).size(), 4U);
    script.Worker(script.WorkerOf(accuser), WorkerTrouble{77, accuser, group.key, accused, Status::Unavailable("does not answer")});
    group = HandedOut(script.Pass(milliseconds(1000))).at(0);
  }
  others.insert(group.display);
  EXPECT_EQ(WorkersOf(group), others);
}

TEST(CoordinatorFrames, WhatAWorkerHadOnAnEarlierConnectionIsHandedOutAgainAtOnce) {
  CoordinatorScript script;
  FakeWorker worker = script.Join(11, 1);
  script.Join(12, 2);
  const auto groups = HandedOut(script.Submit(kClient, Frame(1, 3)));
  script.Done(groups.at(0));
  EXPECT_TRUE(HandedOut(script.Beat(worker)).empty());
  worker.token = 21;
  const auto again = HandedOut(script.Beat(worker));
  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].key, (GroupKey{1, 2, 1})) << "the first group that is not done";
  EXPECT_EQ(WorkersOf(again[0]).size(), 2U);
  EXPECT_TRUE(HandedOut(script.Beat(worker)).empty()) << "once";
}

TEST(CoordinatorFrames, FrameOutlivesAllItsWorkersIfOthersComeInTime) {
  CoordinatorScript script;
  const FakeWorker first = script.Join(11, 1);
  script.Submit(kClient, Frame(1, 2));
  script.Kill(first);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Pass(seconds(9))).empty());
  Actions joined;
  script.Join(12, 2, &joined);
  ASSERT_EQ(Keys(HandedOut(joined)).at(0), (GroupKey{1, 2, 0}));
  EXPECT_EQ(ToClients<FrameReply>(script.AnswerAll(joined)).size(), 1U);
}

TEST(CoordinatorFrames, FrameWhoseWorkersAreAllLostFailsAfterTheWait) {
  CoordinatorScript script;
  const FakeWorker worker = script.Join(11, 1);
  script.Submit(kClient, Frame(1, 2));
  script.Pass(seconds(3));
  script.Kill(worker);
  EXPECT_TRUE(ToClients<FrameFailed>(script.Pass(seconds(10) - Duration(1))).empty());
  const auto failed = ToClients<FrameFailed>(script.Pass(Duration(1)));
  ASSERT_EQ(failed.size(), 1U);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("no worker registered within 10 s"));
}

}  // namespace
}  // namespace slabstream
