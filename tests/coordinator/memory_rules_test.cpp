// What the coordinator does about memory: frames that do not fit, frames that fit one by one, datasets that nobody needs; and frames that
// end their workers.
#include "common/planning/worker_memory.h"
#include "common/volume/memory_budget.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

constexpr DatasetId kBlock = 1;

class MemoryRules : public testing::Test {
 protected:
  FakeWorker JoinWith(CoordinatorScript& script, PeerToken token, std::uint64_t memory_bytes) {
    FakeWorker worker{.token = token, .incarnation = token};
    Register message = CoordinatorScript::RegisterOf(worker);
    message.memory_bytes = memory_bytes;
    worker.id = ToWorkers<Welcome>(script.Worker(worker, message)).at(0).message.worker;
    script.tokens[worker.id] = token;
    script.workers.push_back(worker);
    return worker;
  }
  static SubmitFrame Sized(RequestId request, int side, const std::string& dataset = "block") {
    SubmitFrame submit = Frame(request, 1, dataset);
    submit.frame.size = {side, side};
    return submit;
  }
  // The images of a frame of this size.
  static std::uint64_t ImagesOf(int side, int workers = 1, const std::shared_ptr<const VolumeSummary>& summary = BlockSummary()) {
    CoordinatorScript script;
    for (int i = 1; i <= workers; ++i) script.Join(PeerToken(i), Incarnation(i));
    script.Client(kClient, Sized(1, side));
    const std::vector<GroupAssignment> groups = HandedOut(script.Step(DatasetLoaded{"block", script.loads.back().load, kBlock, summary}));
    return GroupImageBytes(groups.at(0).setup, groups[0].group.placements) + PictureBytes(groups[0].setup);
  }
  static std::uint64_t RoomFor(std::uint64_t images) { return kIdleMemoryBytes + 2 * 32 * 32 * 48 + images; }
};

TEST_F(MemoryRules, AFrameThatDoesNotFitAWorkerFailsBeforeAnyIsGivenAPartOfIt) {
  CoordinatorScript script;
  JoinWith(script, 11, 0);
  JoinWith(script, 12, 256 * kMebi);
  const Actions actions = script.Submit(kClient, Sized(1, 8192));
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("size 8192x8192"));
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("of worker 2, limit 256 MiB"));
  // What fits is rendered.
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(script.Submit(kClient, Sized(2, 64)))), SizeIs(1));
  EXPECT_EQ(script.QueryStatus().workers[1].memory_bytes, 256 * kMebi);
}

TEST_F(MemoryRules, FramesThatFitOneByOneRunOneByOneAndNoneOvertakes) {
  CoordinatorScript script;
  JoinWith(script, 11, RoomFor(ImagesOf(1024)));
  const std::vector<GroupAssignment> first = HandedOut(script.Submit(kClient, Sized(1, 1024)));
  ASSERT_THAT(first, SizeIs(1));
  EXPECT_THAT(HandedOut(script.Submit(kClient, Sized(2, 1024))), IsEmpty());
  EXPECT_THAT(HandedOut(script.Submit(kOther, Sized(1, 64))), IsEmpty());
  const std::vector<GroupAssignment> second = HandedOut(script.Answer(first[0]));
  ASSERT_THAT(second, SizeIs(1)) << "of those that wait, the one in turn, alone or with what fits beside it";
  EXPECT_EQ(script.QueryStatus().running, 1U);
  EXPECT_THAT(HandedOut(script.Answer(second[0])), SizeIs(1));
}

TEST_F(MemoryRules, WithoutALimitTheWindowIsAsWideAsEver) {
  CoordinatorScript script;
  script.Join(11, 1);
  EXPECT_THAT(HandedOut(script.Submit(kClient, Sized(1, 1024))), SizeIs(1));
  EXPECT_THAT(HandedOut(script.Submit(kClient, Sized(2, 1024))), SizeIs(1));
}

TEST_F(MemoryRules, WhatTheLossOfAWorkerMakesTooLargeFails) {
  CoordinatorScript script;
  auto summary = std::make_shared<VolumeSummary>(*BlockSummary());
  summary->description.geometry.size = {32, 32, 4800};
  summary->brick_counts = {2, 2, 300};
  summary->bricks.assign(1200, {0, 255});
  constexpr std::uint64_t kVoxels = 2 * 32 * 32 * 4800;
  const FakeWorker lost = JoinWith(script, 11, 0);
  JoinWith(script, 12, kIdleMemoryBytes + ImagesOf(64, 2, summary) + kVoxels * 7 / 10);  // half of the voxels fit, all do not
  script.Client(kClient, Sized(1, 64));
  ASSERT_THAT(HandedOut(script.Step(DatasetLoaded{"block", script.loads.back().load, kBlock, summary})), SizeIs(1));
  const auto failed = ToClients<FrameFailed>(script.Kill(lost));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(failed[0].message.status.message(), testing::EndsWith("(attempt 2, since worker 1 is gone)"));
}

// ---------------------------------------------------------------- frames that end workers

// A frame whose box 0 has been lost with two workers, one after the other.
class SuspectRules : public MemoryRules {
 protected:
  void SetUp() override {
    for (PeerToken token = 11; token < 16; ++token) script_.Join(token, token);
    const std::vector<GroupAssignment> groups = HandedOut(script_.Submit(kClient, Frame(1)));
    ASSERT_THAT(groups, SizeIs(1));
    script_.Pass(seconds(1));
    const std::vector<GroupAssignment> again = HandedOut(script_.Kill(HolderOf(groups[0])));
    ASSERT_THAT(again, SizeIs(1));
    script_.Pass(seconds(1));
    second_ = HolderOf(again[0]);
  }
  FakeWorker HolderOf(const GroupAssignment& group) {
    return script_.WorkerOf(std::ranges::find(group.group.placements, BoxId{0}, &Placement::id)->worker);
  }
  static std::vector<BoxId> BoxesOf(const GroupAssignment& group, WorkerId worker) {
    std::vector<BoxId> boxes;
    for (const Placement& placement : group.group.placements) {
      if (placement.worker == worker) boxes.push_back(placement.id);
    }
    return boxes;
  }

  CoordinatorScript script_;
  FakeWorker second_;
};

TEST_F(SuspectRules, TheBoxIsTriedAloneAndItsFrameIsToBlameIfAThirdWorkerDies) {
  const std::vector<GroupAssignment> trial = HandedOut(script_.Kill(second_));
  ASSERT_THAT(trial, SizeIs(1));
  const FakeWorker third = HolderOf(trial[0]);
  EXPECT_THAT(BoxesOf(trial[0], third.id), ElementsAre(0));
  EXPECT_NE(trial[0].display, third.id);
  EXPECT_THAT(HandedOut(script_.Submit(kOther, Frame(1))), IsEmpty()) << "others wait until it is over";
  script_.Pass(seconds(1));
  const Actions actions = script_.Kill(third);
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].to, kClient);
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("box 0 of the frame, as two workers before it"));
  EXPECT_THAT(ToClients<FrameReply>(script_.AnswerAll(actions)), SizeIs(1)) << "the other one";
}

TEST_F(SuspectRules, TwoDeathsByChanceFailNoFrame) {
  const std::vector<GroupAssignment> trial = HandedOut(script_.Kill(second_));
  ASSERT_THAT(trial, SizeIs(1));
  EXPECT_THAT(HandedOut(script_.Submit(kOther, Frame(1))), IsEmpty());
  const Actions actions = script_.Answer(trial[0]);
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  ASSERT_THAT(HandedOut(actions), SizeIs(1));
  EXPECT_THAT(WorkersOf(HandedOut(actions)[0]), SizeIs(3)) << "of all workers again";
  EXPECT_THAT(ToClients<FrameReply>(script_.AnswerAll(actions)), SizeIs(2));
}

TEST_F(SuspectRules, TheTrialWaitsForWhatIsUnderWay) {
  const std::vector<GroupAssignment> other = HandedOut(script_.Submit(kOther, Frame(1)));
  ASSERT_THAT(other, SizeIs(1));
  ASSERT_NE(other[0].display, second_.id);
  script_.Done(other[0]);  // its picture is being made
  Actions actions = script_.Kill(second_);
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  EXPECT_GT(script_.machine.NextWake(), script_.now);
  actions = script_.Image(other[0], 1);
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  ASSERT_THAT(HandedOut(actions), SizeIs(1));
  EXPECT_EQ(HandedOut(actions)[0].key.frame, 1U);
  EXPECT_THAT(ToClients<FrameReply>(script_.AnswerAll(actions)), SizeIs(2));
}

TEST_F(SuspectRules, WithOneWorkerLeftItHasEverything) {
  const std::vector<GroupAssignment> trial = HandedOut(script_.Kill(second_));
  ASSERT_THAT(trial, SizeIs(1));
  // Those that leave in order prove nothing.
  Actions actions;
  while (script_.workers.size() > 1) {
    const FakeWorker one = script_.workers.front();
    script_.Mute(one);
    actions = script_.Worker(one, Leave{.epoch = 77, .worker = one.id});
  }
  ASSERT_THAT(HandedOut(actions), SizeIs(1));
  EXPECT_THAT(WorkersOf(HandedOut(actions)[0]), SizeIs(1));
  EXPECT_THAT(ToClients<FrameReply>(script_.AnswerAll(actions)), SizeIs(1));
}

// A host ends with two of its workers: one is found to be silent a moment before the other, and the other gets its boxes meanwhile.
TEST_F(MemoryRules, WorkersThatDieTogetherFailNoFrame) {
  CoordinatorScript script;
  const FakeWorker first = script.Join(11, 1), second = script.Join(12, 2);
  ASSERT_THAT(HandedOut(script.Submit(kClient, Frame(1))), SizeIs(1));
  script.Mute(first);
  script.Pass(milliseconds(300));
  script.Beat(second);
  script.Mute(second);
  Actions actions = script.Pass(milliseconds(5800));
  ASSERT_THAT(HandedOut(actions), SizeIs(1)) << "the second one has all boxes now";
  actions = script.Pass(seconds(1));
  EXPECT_EQ(script.QueryStatus().workers_lost, 2U);
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  script.Join(13, 3, &actions);
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(actions)), SizeIs(1));
}

TEST_F(MemoryRules, WorkersThatLeaveFailNoFrame) {
  CoordinatorScript script;
  std::vector<FakeWorker> all;
  for (PeerToken token = 11; token < 14; ++token) all.push_back(script.Join(token, token));
  ASSERT_THAT(HandedOut(script.Submit(kClient, Frame(1))), SizeIs(1));
  // One that leaves, and one more that gets its boxes and leaves.
  Actions actions = script.Worker(all[0], Leave{.epoch = 77, .worker = all[0].id});
  script.Mute(all[0]);
  const std::vector<GroupAssignment> again = HandedOut(actions);
  ASSERT_THAT(again, SizeIs(1));
  const auto heir = std::ranges::find(again[0].group.placements, BoxId{0}, &Placement::id)->worker;
  const FakeWorker second = script.WorkerOf(heir);
  actions = script.Worker(second, Leave{.epoch = 77, .worker = second.id});
  script.Mute(second);
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(actions)), SizeIs(1));
}

// ---------------------------------------------------------------- datasets

class DatasetRules : public MemoryRules {
 protected:
  static ScriptConfig Config() {
    ScriptConfig config = TestConfig();
    config.datasets = {{"a", {}}, {"b", {}}, {"c", {}}};
    config.memory_bytes = 400 * kMebi;  // 300 for datasets
    return config;
  }
  static DatasetId IdOf(const std::string& name) { return DatasetId(name[0]); }  // the same at each load
  // Answers the load that was begun last.
  Actions Loaded(std::uint64_t bytes) {
    const LoadDataset& load = script.loads.back();
    return script.Step(DatasetLoaded{load.name, load.load, IdOf(load.name), BlockSummary(), bytes});
  }
  // A frame of a dataset of 100 MiB, done.
  Actions Visit(RequestId request, const std::string& dataset) {
    const std::size_t before = script.loads.size();
    Actions actions = script.Client(kClient, Frame(request, 1, dataset));
    if (script.loads.size() > before) CoordinatorScript::Append(actions, Loaded(120 * kMebi));
    return script.AnswerAll(actions);
  }
  DatasetState StateOf(int index) { return script.QueryStatus().datasets[std::size_t(index)].state; }

  CoordinatorScript script{Config()};
};

TEST_F(DatasetRules, TheLeastRecentlyUsedIsUnloadedAndLoadedAgainWhenAskedFor) {
  script.Join(11, 1);
  Visit(1, "a");
  Visit(2, "b");
  Visit(3, "a");
  EXPECT_EQ(script.QueryStatus().datasets[0].memory_bytes, 120 * kMebi);
  const Actions third = Visit(4, "c");
  const std::vector<UnloadDataset> unloaded = Of<UnloadDataset>(third);
  ASSERT_THAT(unloaded, SizeIs(1));
  EXPECT_EQ(unloaded[0].dataset, IdOf("b"));
  EXPECT_THAT(ToClients<FrameReply>(third), SizeIs(1));
  EXPECT_EQ(StateOf(0), DatasetState::kReady);
  EXPECT_EQ(StateOf(1), DatasetState::kUnloaded);
  const std::size_t loads = script.loads.size();
  EXPECT_THAT(ToClients<FrameReply>(Visit(5, "b")), SizeIs(1));
  EXPECT_EQ(script.loads.size(), loads + 1);
  EXPECT_EQ(StateOf(0), DatasetState::kUnloaded);
}

TEST_F(DatasetRules, WhatFramesNeedStaysAndWhatComesOnTopWaitsForTheirEnd) {
  script.Join(11, 1);
  script.Client(kClient, Frame(1, 1, "a"));
  const std::vector<GroupAssignment> running = HandedOut(Loaded(200 * kMebi));
  ASSERT_THAT(running, SizeIs(1));
  script.Client(kClient, Frame(2, 1, "b"));
  const Actions actions = Loaded(150 * kMebi);
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  ASSERT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(actions)[0].dataset, IdOf("b"));
  EXPECT_EQ(StateOf(1), DatasetState::kUnloaded);
  const std::size_t loads = script.loads.size();
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(script.Answer(running[0]))), SizeIs(1));
  ASSERT_EQ(script.loads.size(), loads + 1) << "the frame has ended";
  const Actions second = Loaded(150 * kMebi);
  ASSERT_THAT(Of<UnloadDataset>(second), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(second)[0].dataset, IdOf("a"));
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(second)), SizeIs(1));
}

TEST_F(DatasetRules, WhatTheEndOfFramesMakesNoRoomForIsRefused) {
  script.Join(11, 1);
  script.Client(kClient, Frame(1, 1, "a"));
  ASSERT_THAT(HandedOut(Loaded(100 * kMebi)), SizeIs(1));
  script.Client(kClient, Frame(2, 1, "b"));
  const Actions actions = Loaded(350 * kMebi);
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.request, 2U);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("dataset \"b\" needs 350 MiB, limit 300 MiB (100 MiB are in use"));
  ASSERT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(actions)[0].dataset, IdOf("b"));
}

TEST_F(DatasetRules, ALoadWithoutMemoryWaitsForTheEndOfFrames) {
  script.Join(11, 1);
  script.Client(kClient, Frame(1, 1, "a"));
  const std::vector<GroupAssignment> running = HandedOut(Loaded(200 * kMebi));
  script.Client(kClient, Frame(2, 1, "b"));
  const std::size_t loads = script.loads.size();
  const Status no_memory = Status::ResourceExhausted("b.nrrd needs 300 MiB");
  EXPECT_THAT(ToClients<FrameFailed>(script.Step(DatasetFailed{"b", script.loads.back().load, no_memory})), IsEmpty());
  EXPECT_EQ(script.loads.size(), loads);
  script.AnswerAll(script.Answer(running.at(0)));
  ASSERT_EQ(script.loads.size(), loads + 1);
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(Loaded(150 * kMebi))), SizeIs(1));
}

TEST_F(DatasetRules, ALoadWithoutMemoryIsTriedAgainWhenOthersAreUnloaded) {
  script.Join(11, 1);
  Visit(1, "a");
  script.Client(kClient, Frame(2, 1, "b"));
  const Status no_memory = Status::ResourceExhausted("b.nrrd needs 300 MiB");
  const std::size_t loads = script.loads.size();
  Actions actions = script.Step(DatasetFailed{"b", script.loads.back().load, no_memory});
  EXPECT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  ASSERT_EQ(script.loads.size(), loads + 1);
  // Now there is nothing more to unload.
  actions = script.Step(DatasetFailed{"b", script.loads.back().load, no_memory});
  EXPECT_THAT(ToClients<FrameFailed>(actions), SizeIs(1));
  EXPECT_EQ(script.loads.size(), loads + 1);
}

}  // namespace
}  // namespace slabstream
