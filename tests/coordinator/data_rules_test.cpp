// What the coordinator does about files that change, watched folders, and orders about datasets; which requests it refuses; what it logs.
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

constexpr PeerToken kAdmin = 31;

// Two datasets that are files, and a folder.
ScriptConfig FilesConfig() {
  ScriptConfig config = TestConfig();
  config.datasets = {{"block", DataSource("/named/block.nrrd", "")}, {"other", DataSource("/named/other.nrrd", "")}};
  return config;
}

std::vector<std::string> NamesOf(const std::vector<DatasetStatus>& datasets) {
  std::vector<std::string> names;
  for (const DatasetStatus& dataset : datasets) names.push_back(dataset.name);
  return names;
}

class DataRules : public testing::Test {
 protected:
  explicit DataRules(const ScriptConfig& config = FilesConfig()) : script(config) { script.Join(11, 1); }

  // The end of the load that was begun last: the file holds these voxels.
  Actions Loaded(DatasetId voxels, std::uint64_t bytes = 0) {
    const LoadDataset load = script.loads.back();
    return script.Step(DatasetLoaded{load.name, load.load, voxels, BlockSummary(), bytes, std::make_shared<const FileStamp>()});
  }
  // The end of a look.
  Actions Seen(const CheckDatasetFiles& look, Result<bool> changed) {
    return script.Step(DatasetSeen{look.name, look.load, std::move(changed)});
  }
  static CheckDatasetFiles LookOf(const Actions& actions) {
    const std::vector<CheckDatasetFiles> looks = Of<CheckDatasetFiles>(actions);
    EXPECT_THAT(looks, SizeIs(1));
    return looks.empty() ? CheckDatasetFiles{} : looks[0];
  }
  // A frame of the block, which is not loaded yet, that has begun. Its voxels are number 1.
  std::vector<GroupAssignment> Begin(RequestId request = 1, int groups = 2) {
    script.Client(kClient, Frame(request, groups));
    return HandedOut(Loaded(1));
  }
  DatasetState StateOf(const std::string& name) {
    for (const DatasetStatus& dataset : script.QueryStatus().datasets) {
      if (dataset.name == name) return dataset.state;
    }
    ADD_FAILURE() << name << " is not in the catalogue";
    return DatasetState::kFailed;
  }

  CoordinatorScript script;
};

// ---------------------------------------------------------------- voxels of other processes

class OwnedDataRules : public DataRules {
 protected:
  static ScriptConfig Config() {
    ScriptConfig config = TestConfig();
    config.datasets = {{"other", DataSource("/named/other.nrrd", "")}};
    return config;
  }
  OwnedDataRules() : DataRules(Config()) {}
};

TEST_F(OwnedDataRules, ComeAreGivenUpWhileNobodyWaitsAndGo) {
  DataSource source("2 owners", "");
  source.open = [](Missing) { return Result<std::shared_ptr<VolumeSource>>(Status::Unavailable("an owner has left")); };
  script.Step(OwnedData{"block", source});
  EXPECT_EQ(StateOf("block"), DatasetState::kUnloaded);
  script.Client(kClient, Frame(1, 1));
  script.Step(OwnedData{"block"});
  EXPECT_EQ(StateOf("block"), DatasetState::kLoading) << "a frame waits for it";
  EXPECT_THAT(HandedOut(Loaded(1)), SizeIs(1));
  EXPECT_EQ(StateOf("block"), DatasetState::kReady);
  script.Step(OwnedData{"block"});
  EXPECT_EQ(StateOf("block"), DatasetState::kReady) << "people are told what it was at the time before";
  EXPECT_THAT(Of<LoadDataset>(script.Client(kClient, Frame(2, 1))), SizeIs(1)) << "the first frame ends with what it has begun with";
  script.Step(OwnedData{.name = "block", .left = true});
  script.Step(OwnedData{.name = "other", .left = true});
  EXPECT_THAT(NamesOf(script.QueryStatus().datasets), ElementsAre("other"));
}

TEST_F(OwnedDataRules, WhoeverWantsThatSeesWhatIsThereWhileOwnersAreGone) {
  const auto ended = [&](const Status& status) {
    const LoadDataset load = script.loads.back();
    return script.Step(DatasetFailed{load.name, load.load, status});
  };
  const Status gone = Status::Unavailable("an owner has left");
  DataSource source("2 owners", "");
  source.open = [](Missing) { return Result<std::shared_ptr<VolumeSource>>(Status::Unavailable("nobody asks")); };
  script.Step(OwnedData{"block", source});
  SubmitFrame skips = Frame(1, 1), fails = Frame(2, 1);
  skips.frame.missing = Missing::kSkip;
  script.Client(kClient, skips);
  EXPECT_EQ(script.loads.back().source.missing, Missing::kFail) << "all may be there";
  script.Client(kOther, fails);
  ASSERT_THAT(script.loads, SizeIs(1));
  const auto failed = ToClients<FrameFailed>(ended(gone));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.message(), "an owner has left");
  ASSERT_THAT(script.loads, SizeIs(2));
  EXPECT_EQ(script.loads[1].source.missing, Missing::kSkip);

  script.Client(kOther, Frame(3, 1));  // meanwhile the same again
  ASSERT_THAT(script.loads, SizeIs(3));
  EXPECT_THAT(ToClients<FrameFailed>(ended(gone)), SizeIs(1));
  ASSERT_THAT(script.loads, SizeIs(3)) << "what is there is still being loaded";
  const LoadDataset part = script.loads[1];
  EXPECT_THAT(HandedOut(script.Step(DatasetLoaded{part.name, part.load, 1, BlockSummary(), 0, std::make_shared<const FileStamp>()})),
              SizeIs(1));

  SubmitFrame last = Frame(4, 1);
  last.frame.missing = Missing::kLast;
  script.Client(kOther, last);
  ended(gone);
  EXPECT_EQ(script.loads.back().source.missing, Missing::kLast);
  EXPECT_THAT(ToClients<FrameFailed>(ended(Status::Unavailable("nobody has it"))), SizeIs(1));
  script.Step(OwnedData{.name = "block", .left = true});
  EXPECT_EQ(script.machine.sizes().uses, 1U) << "the frame that has begun";
}

// Else owners with few slots, which may not overwrite that time, could give no other one.
TEST_F(OwnedDataRules, WhatWasThereIsGivenUpWhileSomebodyWaitsForAll) {
  DataSource source("2 owners", "");
  source.open = [](Missing) { return Result<std::shared_ptr<VolumeSource>>(Status::Unavailable("nobody asks")); };
  script.Step(OwnedData{"block", source});
  SubmitFrame skips = Frame(1, 1);
  skips.frame.missing = Missing::kSkip;
  script.Client(kClient, skips);
  const LoadDataset all = script.loads.back();
  script.Step(DatasetFailed{all.name, all.load, Status::Unavailable("an owner has left")});
  const LoadDataset part = script.loads.back();
  script.Step(DatasetLoaded{part.name, part.load, 7, BlockSummary(), 0, std::make_shared<const FileStamp>()});
  script.Client(kClient, CancelFrame{1});
  EXPECT_THAT(Of<UnloadDataset>(script.Client(kOther, Frame(2, 1))), SizeIs(0));
  const auto unloaded = Of<UnloadDataset>(script.Step(OwnedData{"block"}));
  ASSERT_THAT(unloaded, SizeIs(1));
  EXPECT_EQ(unloaded[0].dataset, 7U);
  EXPECT_EQ(StateOf("block"), DatasetState::kLoading) << "it is waited for";
}

// ---------------------------------------------------------------- servers

TEST_F(DataRules, ALoadFromAServerIsGivenUpAWhileAfterTheLastOneWhoWaitsForItLeaves) {
  CoordinatorScript far([] {
    ScriptConfig config = TestConfig();
    config.datasets = {{"block", DataSource("http://example.org/a.zarr", "")}};
    return config;
  }());
  far.Join(11, 1);
  far.clients = {kClient, kOther};
  far.Client(kClient, Frame(1));
  ASSERT_THAT(far.loads, SizeIs(1));
  const std::stop_token first = far.loads[0].stop;
  far.Pass(2 * kUnwanted);
  far.Client(kClient, CancelFrame{1});
  far.Pass(kUnwanted / 2);
  far.Client(kOther, Frame(2));
  far.Pass(kUnwanted);
  EXPECT_THAT(far.loads, SizeIs(1));
  EXPECT_FALSE(first.stop_requested()) << "somebody else waits for it";
  far.Client(kOther, CancelFrame{2});
  far.Pass(kUnwanted + seconds(1));
  EXPECT_TRUE(first.stop_requested());
  far.Step(DatasetFailed{"block", far.loads[0].load, Status::Cancelled("nobody waits")});

  far.Client(kOther, Frame(3));
  ASSERT_THAT(far.loads, SizeIs(2));
  far.Step(DatasetLoaded{"block", far.loads[1].load, 7, BlockSummary()});
  far.Client(kOther, DataOrder{.nonce = 1, .action = DataAction::kRemove, .items = {"block"}});
  EXPECT_FALSE(far.loads[1].stop.stop_requested()) << "nothing stops what was loaded";
}

TEST_F(DataRules, ADatasetThatIsRemovedIsNotLoadedToTheEnd) {
  script.Client(kClient, Frame(1));
  ASSERT_THAT(script.loads, SizeIs(1));
  script.Client(kClient, DataOrder{.nonce = 1, .action = DataAction::kRemove, .items = {"block"}});
  EXPECT_TRUE(script.loads[0].stop.stop_requested());
}

// ---------------------------------------------------------------- files

TEST_F(DataRules, AFrameWaitsForALookThatBeganAfterItsRequest) {
  const std::vector<GroupAssignment> loaded = Begin(1, 1);
  ASSERT_THAT(loaded, SizeIs(1)) << "the load itself was a look";
  script.Answer(loaded[0]);

  Actions actions = script.Client(kClient, Frame(2));
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  const CheckDatasetFiles first = LookOf(actions);
  actions = script.Client(kOther, Frame(3));
  EXPECT_THAT(Of<CheckDatasetFiles>(actions), IsEmpty()) << "one at a time";
  actions = Seen(first, false);
  ASSERT_THAT(HandedOut(actions), SizeIs(1)) << "the look began before the other one's request";
  EXPECT_THAT(HandedOut(Seen(LookOf(actions), false)), SizeIs(1));
  EXPECT_THAT(script.loads, SizeIs(1));
}

TEST_F(DataRules, AVolumeThatIsNoFileIsNotLookedAt) {
  script.AnswerAll(script.Submit(kClient, Frame(1)));
  const Actions actions = script.Client(kClient, Frame(2));
  EXPECT_THAT(Of<CheckDatasetFiles>(actions), IsEmpty());
  EXPECT_THAT(HandedOut(actions), SizeIs(1));
}

TEST_F(DataRules, AChangedFileIsReadAnewAndWhatHasBegunEndsWithItsVoxels) {
  const std::vector<GroupAssignment> old = Begin();
  ASSERT_THAT(old, SizeIs(2));
  Actions actions = script.Client(kOther, Frame(1));
  actions = Seen(LookOf(actions), true);
  ASSERT_THAT(script.loads, SizeIs(2));
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  EXPECT_THAT(Of<UnloadDataset>(actions), IsEmpty()) << "a frame is rendered from them";
  actions = Loaded(2);
  EXPECT_THAT(Of<UnloadDataset>(actions), IsEmpty());
  EXPECT_EQ(script.machine.sizes().retired, 1U);

  // The worker of the old frame is lost: the next attempt is of the old voxels, too.
  script.Kill(script.workers[0]);
  script.Join(12, 2, &actions);
  for (const GroupAssignment& group : HandedOut(actions)) EXPECT_EQ(group.setup.dataset, group.key.frame == old[0].key.frame ? 1U : 2U);
  const Actions done = script.AnswerAll(actions);
  EXPECT_THAT(ToClients<FrameReply>(done), SizeIs(2));
  ASSERT_THAT(Of<UnloadDataset>(done), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(done)[0].dataset, 1U);
  EXPECT_EQ(script.machine.sizes().retired, 0U);
}

TEST_F(DataRules, VoxelsThatAreTheSameAgainStay) {
  const std::vector<GroupAssignment> running = Begin();
  Actions actions = script.Client(kOther, Frame(1));
  Seen(LookOf(actions), true);
  actions = Loaded(1);  // only its times have changed
  EXPECT_THAT(Of<UnloadDataset>(actions), IsEmpty());
  for (const GroupAssignment& group : running) CoordinatorScript::Append(actions, script.Answer(group));
  EXPECT_THAT(Of<UnloadDataset>(script.AnswerAll(actions)), IsEmpty());
  EXPECT_EQ(script.machine.sizes().retired, 0U);
}

TEST_F(DataRules, ALookForWhichThereIsNoMemoryRefusesItsRequestsAlone) {
  for (const GroupAssignment& group : Begin()) script.Answer(group);
  Actions actions = script.Client(kOther, Frame(1));
  actions = Seen(LookOf(actions), Status::ResourceExhausted("checking the files of a dataset: not enough memory"));
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("checking the files of a dataset: not enough memory"));
  EXPECT_THAT(Of<UnloadDataset>(actions), IsEmpty());
  EXPECT_EQ(StateOf("block"), DatasetState::kReady) << "its voxels are still good";
  actions = script.Client(kOther, Frame(2));
  EXPECT_THAT(HandedOut(Seen(LookOf(actions), false)), SizeIs(1));
  EXPECT_THAT(script.loads, SizeIs(1));
}

TEST_F(DataRules, AFileThatCannotBeReadFailsItsRequestsAndIsTriedAgain) {
  for (const GroupAssignment& group : Begin()) script.Answer(group);
  Actions actions = script.Client(kOther, Frame(1));
  actions = Seen(LookOf(actions), Status::NotFound("/data/block.nrrd: No such file or directory"));
  auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].to, kOther);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("No such file"));
  EXPECT_EQ(StateOf("block"), DatasetState::kFailed);

  script.Client(kOther, Frame(2));
  ASSERT_THAT(script.loads, SizeIs(2));
  failed = ToClients<FrameFailed>(script.Step(DatasetFailed{"block", script.loads[1].load, Status::DataLoss("truncated")}));
  EXPECT_THAT(failed, SizeIs(1));
  script.Client(kOther, Frame(3));
  actions = Loaded(2);
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  EXPECT_EQ(StateOf("block"), DatasetState::kReady);
}

TEST_F(DataRules, LateAnswersOfEarlierLoadsAndLooksChangeNothing) {
  Begin(1, 1);
  Actions actions = script.Client(kOther, Frame(1));
  const CheckDatasetFiles look = LookOf(actions);
  script.Client(kAdmin, DataOrder{.nonce = 1, .action = DataAction::kReload, .items = {"block"}});
  ASSERT_THAT(script.loads, SizeIs(2));
  EXPECT_THAT(Seen(look, true), IsEmpty());
  EXPECT_THAT(Seen(look, Status::NotFound("gone")), IsEmpty());
  // A load that nobody waits for any more: the executor has its voxels and may drop them.
  script.Client(kAdmin, DataOrder{.nonce = 2, .action = DataAction::kReload, .items = {"block"}});
  ASSERT_THAT(script.loads, SizeIs(3));
  actions = script.Step(DatasetLoaded{"block", script.loads[1].load, 9, BlockSummary(), 0, nullptr});
  ASSERT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(actions)[0].dataset, 9U);
  EXPECT_THAT(script.Step(DatasetFailed{"block", script.loads[1].load, Status::DataLoss("truncated")}), IsEmpty());
  EXPECT_EQ(HandedOut(Loaded(2)).at(0).setup.dataset, 2U);
}

TEST_F(DataRules, DeadlinesHoldWhileAFileSystemDoesNotAnswer) {
  for (const GroupAssignment& group : Begin()) script.Answer(group);
  SubmitFrame submit = Frame(2);
  submit.deadline_ms = 2000;
  script.clients = {kClient};
  script.Client(kClient, submit);
  const auto failed = ToClients<FrameFailed>(script.Pass(seconds(2)));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].message.status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("its dataset's files were still being looked at"));
}

// ---------------------------------------------------------------- orders

class DataOrders : public DataRules {
 protected:
  Actions Order(DataAction action, std::vector<std::string> items, PeerToken admin = kAdmin) {
    return script.Client(admin, DataOrder{.nonce = 5, .action = action, .items = std::move(items)});
  }
  // The executor has found out what the order means.
  Actions Found(const Actions& order, Result<FoundData> found) {
    const std::vector<FindDatasets> finds = Of<FindDatasets>(order);
    EXPECT_THAT(finds, SizeIs(1));
    return finds.empty() ? Actions{} : script.Step(DatasetsFound{finds[0].order, std::move(found)});
  }
  static FoundData Named(const std::string& name) {
    FoundData found;
    found.datasets[name] = DataSource("/data/" + name, "");
    return found;
  }
  static std::vector<std::string> Listed(const Actions& actions) {
    const auto replies = ToClients<DataReply>(actions);
    EXPECT_THAT(replies, SizeIs(1));
    if (replies.empty()) return {};
    EXPECT_EQ(replies[0].message.nonce, 5U);
    return NamesOf(replies[0].message.datasets);
  }
  static Status Refused(const Actions& actions) {
    const auto refused = ToClients<OrderRefused>(actions);
    EXPECT_THAT(refused, SizeIs(1));
    return refused.empty() ? Status::Ok() : refused[0].message.status;
  }
};

TEST_F(DataOrders, WhatIsAddedIsThereAtOnceAndWhatIsRemovedIsNot) {
  EXPECT_THAT(Listed(Found(Order(DataAction::kAdd, {"more=/data/more"}), Named("more"))), ElementsAre("block", "more", "other"));
  script.Client(kClient, Frame(1, 1, "more"));
  ASSERT_THAT(script.loads, SizeIs(1));
  EXPECT_EQ(script.loads[0].source.path, "/data/more");
  const std::vector<GroupAssignment> running = HandedOut(Loaded(3));
  ASSERT_THAT(running, SizeIs(1));
  const Actions queued = script.Client(kOther, Frame(1, 1, "more"));

  Actions actions = Order(DataAction::kRemove, {"more"});
  EXPECT_THAT(Listed(actions), ElementsAre("block", "other"));
  const auto failed = ToClients<FrameFailed>(actions);
  ASSERT_THAT(failed, SizeIs(1)) << "what has not begun ends; what has begun goes on";
  EXPECT_EQ(failed[0].to, kOther);
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("dataset \"more\" is not in the catalogue any more"));
  EXPECT_THAT(Of<UnloadDataset>(actions), IsEmpty());
  actions = script.Answer(running[0]);
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(1));
  EXPECT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  EXPECT_THAT(Seen(LookOf(queued), false), IsEmpty()) << "a look at what has been removed";

  EXPECT_THAT(ToClients<FrameFailed>(script.Client(kOther, Frame(2, 1, "more"))), SizeIs(1));
  EXPECT_EQ(script.QueryStatus().refused.unknown_dataset, 1U);
}

TEST_F(DataOrders, TimesOfAFileAreOrderedByTheirNumbers) {
  FoundData times;
  for (const char* name : {"beat@0", "beat@2", "beat@10"}) times.datasets[name] = DataSource("/data/beat.npy", "");
  EXPECT_THAT(Listed(Found(Order(DataAction::kAdd, {"beat=/data/beat.npy?time=0:2"}), times)),
              ElementsAre("beat@0", "beat@2", "beat@10", "block", "other"));
  EXPECT_THAT(Refused(Order(DataAction::kRemove, {"bea"})).message(),
              HasSubstr("no dataset \"bea\": the catalogue has beat@0, beat@2, beat@10"));
  EXPECT_THAT(Listed(Order(DataAction::kRemove, {"beat@2"})), ElementsAre("beat@0", "beat@10", "block", "other"));
  EXPECT_THAT(Listed(Order(DataAction::kReload, {"beat"})), ElementsAre("beat@0", "beat@10", "block", "other"));
  EXPECT_THAT(Listed(Order(DataAction::kRemove, {"beat", "beat@0"})), ElementsAre("block", "other"));
}

TEST_F(DataOrders, WhatIsRemovedWhileItIsReadIsDroppedWhenItHasBeenRead) {
  script.Client(kClient, Frame(1));
  EXPECT_THAT(ToClients<FrameFailed>(Order(DataAction::kRemove, {"block"})), SizeIs(1));
  const Actions actions = Loaded(4);
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  EXPECT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
}

TEST_F(DataOrders, OrdersAreCarriedOutAsAWholeOrNotAtAll) {
  const std::pair<Actions, const char*> refused[] = {
      {Order(DataAction::kRemove, {"block", "nonesuch"}), "no dataset \"nonesuch\": the catalogue has block, other"},
      {Order(DataAction::kReload, {"block", "nonesuch"}), "no dataset \"nonesuch\""},
      {Order(DataAction::kRemove, {"/data"}), "/data is no watched folder"},
      {Found(Order(DataAction::kAdd, {"block=/x"}), Named("block")), "there is already a dataset named \"block\""},
      {Found(Order(DataAction::kAdd, {"x=/x"}), Status::NotFound("/x does not exist")), "/x does not exist"},
  };
  for (const auto& [actions, why] : refused) EXPECT_THAT(Refused(actions).message(), HasSubstr(why));
  EXPECT_THAT(script.loads, IsEmpty());
  EXPECT_THAT(NamesOf(script.QueryStatus().datasets), ElementsAre("block", "other"));
  EXPECT_EQ(script.machine.sizes().orders, 0U);
}

TEST_F(DataOrders, TheCatalogueHasALimit) {
  ScriptConfig config = FilesConfig();
  config.max_datasets = 2;
  CoordinatorScript full(config);
  const Actions order = full.Client(kAdmin, DataOrder{.nonce = 5, .action = DataAction::kAdd, .items = {"more=/data/more"}});
  const Status status = Refused(full.Step(DatasetsFound{Of<FindDatasets>(order).at(0).order, Named("more")}));
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), HasSubstr("2 datasets and 1 more, the catalogue has at most 2"));
}

TEST_F(DataOrders, AClientThatGoesOrOrdersSomethingElseIsNotAnswered) {
  const Actions gone = Order(DataAction::kAdd, {"more=/data/more"});
  script.Step(ClientGone{kAdmin});
  EXPECT_THAT(Found(gone, Named("more")), IsEmpty());
  const Actions replaced = Order(DataAction::kAdd, {"more=/data/more"});
  Order(DataAction::kReload, {"block"});
  EXPECT_THAT(Found(replaced, Named("more")), IsEmpty());
  EXPECT_EQ(script.machine.sizes().orders, 0U);
}

TEST_F(DataOrders, AListTellsWhatTheFilesAreNow) {
  EXPECT_THAT(Listed(Order(DataAction::kList, {})), ElementsAre("block", "other")) << "nothing is loaded, there is nothing to look at";
  for (const GroupAssignment& group : Begin()) script.Answer(group);
  script.Pass(seconds(3));
  Actions actions = Order(DataAction::kList, {}, kOther);
  EXPECT_THAT(ToClients<DataReply>(actions), IsEmpty());
  const auto replies = ToClients<DataReply>(Seen(LookOf(actions), false));
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_EQ(replies[0].message.datasets[0].state, DatasetState::kReady);
  EXPECT_EQ(replies[0].message.datasets[0].since_ms, 3000U);
  actions = Order(DataAction::kList, {});
  const auto changed = ToClients<DataReply>(Seen(LookOf(actions), true));
  ASSERT_THAT(changed, SizeIs(1));
  EXPECT_EQ(changed[0].message.datasets[0].state, DatasetState::kUnloaded);
}

// ---------------------------------------------------------------- watched folders

class FolderRules : public DataOrders {
 protected:
  static constexpr const char* kFolder = "/data";
  static FoundData In(const std::vector<std::string>& files) {
    FoundData found;
    for (const std::string& file : files) found.datasets[file.substr(0, file.find('.'))] = DataSource("/data/" + file, kFolder);
    return found;
  }
  Actions SeenFolder(Result<FoundData> found) {
    std::map<std::string, Result<FoundData>> folders;
    folders.emplace(kFolder, std::move(found));
    return script.Step(FoldersSeen{std::move(folders)});
  }
  // The service watches the folder, which holds these files.
  void Watch(const std::vector<std::string>& files) {
    FoundData found = In(files);
    found.folders = {kFolder};
    Found(Order(DataAction::kAdd, {kFolder}), std::move(found));
  }
  std::vector<std::string> Names() { return NamesOf(script.QueryStatus().datasets); }
};

TEST_F(FolderRules, WhatIsUnchangedStaysAndOnlyThoseWhoAskHaveItSearched) {
  Watch({"a.nrrd"});
  Actions actions = script.Pass(script.config.check_interval);
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_FALSE(Of<CheckWatchedFolders>(actions)[0].asked_for);
  script.Step(FoldersSeen{.folders = {}, .unchanged = {kFolder}});
  EXPECT_THAT(Names(), ElementsAre("a", "block", "other"));
  actions = script.Client(kOther, Frame(1, 1, "nonesuch"));
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_TRUE(Of<CheckWatchedFolders>(actions)[0].asked_for);
  SeenFolder(In({"a.nrrd"}));
  actions = Order(DataAction::kList, {});
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_TRUE(Of<CheckWatchedFolders>(actions)[0].asked_for);
  SeenFolder(In({"a.nrrd"}));
  actions = script.Pass(script.config.check_interval);
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_FALSE(Of<CheckWatchedFolders>(actions)[0].asked_for);
}

TEST_F(FolderRules, FilesThatComeAndGoAreDatasetsThatComeAndGo) {
  Watch({"a.nrrd"});
  EXPECT_THAT(Names(), ElementsAre("a", "block", "other"));
  const Actions actions = script.Pass(script.config.check_interval);
  EXPECT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_THAT(Of<CheckWatchedFolders>(script.Pass(seconds(60))), IsEmpty()) << "one at a time";
  SeenFolder(In({"a.nrrd", "b.nrrd", "block.nrrd"}));
  EXPECT_THAT(Names(), ElementsAre("a", "b", "block", "other"));
  script.Client(kClient, Frame(1));
  EXPECT_EQ(script.loads.back().source.path, "/named/block.nrrd") << "what was named stays what it was";
  SeenFolder(In({"b.nrrd"}));
  EXPECT_THAT(Names(), ElementsAre("b", "block", "other"));
  SeenFolder(Status::Unavailable("/data: Stale file handle"));
  EXPECT_THAT(Names(), ElementsAre("b", "block", "other")) << "nobody knows whether it has gone";
}

TEST_F(FolderRules, ANameThatIsNotKnownIsLookedFor) {
  Watch({});
  Actions actions = script.Client(kClient, Frame(1, 1, "a"));
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty());
  EXPECT_THAT(Names(), ElementsAre("block", "other")) << "who asks for a name does not put it into the catalogue";
  EXPECT_THAT(Of<CheckWatchedFolders>(script.Client(kOther, Frame(1, 1, "nonesuch"))), IsEmpty());
  actions = SeenFolder(In({"a.nrrd"}));
  EXPECT_THAT(script.loads, SizeIs(1));
  EXPECT_THAT(ToClients<FrameFailed>(actions), IsEmpty()) << "that look began before the other request";
  ASSERT_THAT(Of<CheckWatchedFolders>(actions), SizeIs(1));
  const auto failed = ToClients<FrameFailed>(SeenFolder(In({"a.nrrd"})));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_THAT(failed[0].message.status.message(), HasSubstr("no dataset \"nonesuch\": the catalogue has a, block, other"));
  EXPECT_THAT(HandedOut(Loaded(3)), SizeIs(1));
  EXPECT_EQ(script.QueryStatus().refused.unknown_dataset, 1U);
  EXPECT_EQ(script.QueryStatus().frames_failed, 0U);
  EXPECT_EQ(script.machine.sizes().awaited, 0U);
}

TEST_F(FolderRules, AFileOfAnotherEndingIsTheSameDatasetAnew) {
  Watch({"a.nrrd"});
  script.Client(kClient, Frame(1, 1, "a"));
  for (const GroupAssignment& group : HandedOut(Loaded(3))) script.Answer(group);
  const Actions actions = SeenFolder(In({"a.nii"}));
  EXPECT_THAT(Of<UnloadDataset>(actions), SizeIs(1));
  script.Client(kClient, Frame(2, 1, "a"));
  EXPECT_EQ(script.loads.back().source.path, "/data/a.nii");
}

TEST_F(FolderRules, WhatWasRemovedStaysAwayUntilItsFileHasGone) {
  Watch({"a.nrrd", "b.nrrd"});
  Order(DataAction::kRemove, {"a"});
  SeenFolder(In({"a.nrrd", "b.nrrd"}));
  EXPECT_THAT(Names(), ElementsAre("b", "block", "other"));
  SeenFolder(In({"b.nrrd"}));
  SeenFolder(In({"a.nrrd", "b.nrrd"}));
  EXPECT_THAT(Names(), ElementsAre("a", "b", "block", "other")) << "that is another file";
}

TEST_F(FolderRules, AFolderThatIsRemovedTakesItsDatasetsAlong) {
  Watch({"a.nrrd"});
  EXPECT_THAT(Refused(Found(Order(DataAction::kAdd, {kFolder}),
                            [] {
                              FoundData again = In({"a.nrrd"});
                              again.folders = {kFolder};
                              return again;
                            }()))
                  .message(),
              HasSubstr("/data is watched already"));
  EXPECT_THAT(Listed(Order(DataAction::kRemove, {kFolder})), ElementsAre("block", "other"));
  EXPECT_THAT(Of<CheckWatchedFolders>(script.Pass(seconds(60))), IsEmpty());
  SeenFolder(In({"a.nrrd"}));  // of a look that was under way
  EXPECT_THAT(Names(), ElementsAre("block", "other"));
  EXPECT_THAT(ToClients<FrameFailed>(script.Client(kClient, Frame(1, 1, "a"))), SizeIs(1))
      << "nothing is watched: the answer comes at once";
}

// ---------------------------------------------------------------- what is refused, and what is logged

TEST_F(DataRules, RefusedRequestsAreCountedByTheirReason) {
  script.Client(kClient, Frame(1, 1, "nonesuch"));
  SubmitFrame bad = Frame(2);
  bad.frame.policy.decomposition = "nonesuch";
  script.Client(kClient, bad);
  const Status bad_field = Status::InvalidArgument("SubmitFrame.frame.size.width: 0");
  script.Step(BadRequest{kOther, FrameFailed{.request = 9, .status = bad_field}, bad_field});
  ScriptConfig config = FilesConfig();
  config.max_queued = 1;
  CoordinatorScript busy(config);
  busy.Client(kClient, Frame(1));
  busy.Client(kOther, Frame(1));
  EXPECT_EQ(busy.QueryStatus().refused, (RefusedRequests{.over_quota = 1}));
  EXPECT_EQ(script.QueryStatus().refused, (RefusedRequests{.bad_request = 2, .unknown_dataset = 1}));
  EXPECT_EQ(script.QueryStatus().frames_failed, 0U);
  script.Client(kClient, Frame(3));
  script.Step(DatasetFailed{"block", script.loads.back().load, Status::ResourceExhausted("block.nrrd needs 3 TiB")});
  EXPECT_EQ(script.QueryStatus().refused.too_large, 1U);
  script.Client(kClient, Frame(4));
  script.Step(DatasetFailed{"block", script.loads.back().load, Status::DataLoss("truncated")});
  EXPECT_EQ(script.QueryStatus().frames_failed, 1U);
}

std::vector<std::string> NotesOf(const Actions& actions) {
  std::vector<std::string> texts;
  for (const Note& note : Of<Note>(actions)) texts.push_back(note.text);
  return texts;
}

TEST(CoordinatorNotes, TellWhatHappensOnceEach) {
  ScriptConfig config = FilesConfig();
  config.log_level = LogLevel::kInfo;
  CoordinatorScript script(config);
  Actions all;
  const FakeWorker worker = script.Join(11, 1, &all);
  CoordinatorScript::Append(all, script.Worker(worker, CoordinatorScript::RegisterOf(worker)));  // its Welcome was lost
  CoordinatorScript::Append(all, script.AnswerAll(script.Submit(kClient, Frame(1))));
  CoordinatorScript::Append(all, script.Leave(worker.id));
  EXPECT_THAT(NotesOf(all),
              ElementsAre(HasSubstr("worker 1 is here: pid 1 on here"), HasSubstr("dataset \"block\" is loaded: 32 x 32 x 48 voxels"),
                          testing::AllOf(HasSubstr("frame 1 of client 21: dataset block, splat, 64x64, "),
                                         HasSubstr(" ms, workers 1, attempts 1: done")),
                          HasSubstr("worker 1 is leaving"), HasSubstr("worker 1 has left")));
  script.Join(12, 2);
  const std::vector<Note> lost = Of<Note>(script.Pass(seconds(1)));
  EXPECT_THAT(lost, IsEmpty());
  const std::vector<Note> gone = Of<Note>(script.Kill(script.workers.back()));
  ASSERT_THAT(gone, SizeIs(1));
  EXPECT_EQ(gone[0].level, LogLevel::kWarning);
}

TEST(CoordinatorNotes, SayWhyAFrameBeginsAgain) {
  ScriptConfig config = TestConfig();
  config.log_level = LogLevel::kWarning;
  CoordinatorScript script(config);
  const FakeWorker worker = script.Join(11, 1);
  script.Join(12, 2);
  const GroupAssignment group = HandedOut(script.Submit(kClient, Frame(1))).at(0);
  const WorkerTrouble trouble{77, worker.id, group.key, 0, Status::ResourceExhausted("no memory"), true};
  EXPECT_THAT(NotesOf(script.Worker(worker, trouble)), ElementsAre("frame 1 of client 21: attempt 2, since worker 1: no memory"));
}

TEST(CoordinatorNotes, AreNotMadeBelowTheLevelThatIsWanted) {
  ScriptConfig config = FilesConfig();
  config.log_level = LogLevel::kWarning;
  CoordinatorScript script(config);
  const FakeWorker worker = script.Join(11, 1);
  EXPECT_THAT(Of<Note>(script.AnswerAll(script.Submit(kClient, Frame(1)))), IsEmpty());
  EXPECT_THAT(Of<Note>(script.Kill(worker)), SizeIs(1));
  CoordinatorScript quiet;
  EXPECT_THAT(Of<Note>(quiet.Kill(quiet.Join(11, 1))), IsEmpty());
}

}  // namespace
}  // namespace slabstream
