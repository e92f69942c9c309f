// What the coordinator does about datasets with several fields and times, told as scripts.
#include "common/planning/levels.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

std::shared_ptr<const DatasetFields> ThreeChannels() {
  return std::make_shared<const DatasetFields>(
      DatasetFields{.fields = {{.name = "DAPI"}, {.name = "Actin"}, {.name = "GFP"}, {.name = "overlay", .channel = false, .shown = false}},
                    .times = {.count = 5}});
}

SubmitFrame Showing(RequestId request, std::vector<std::string> channels, const std::string& time = "") {
  SubmitFrame submit = Frame(request);
  submit.frame.renderer = "raycast";
  submit.frame.transfer = {};
  submit.frame.channels = std::move(channels);
  submit.frame.time = time;
  return submit;
}

class FieldRules : public testing::Test {
 protected:
  static ScriptConfig Config(std::uint64_t memory_bytes) {
    ScriptConfig config = TestConfig();
    config.datasets = {{"block", DataSource("/named/block.tif", "", {.overlay = "/named/map.nii"})}};
    config.memory_bytes = memory_bytes;
    return config;
  }
  explicit FieldRules(std::uint64_t memory_bytes = 0) : script(Config(memory_bytes)) { script.Join(11, 1); }

  // The end of a load. Each load has voxels of its own.
  Actions Loaded(const LoadDataset& load, std::uint64_t bytes = 0) {
    return script.Step(
        DatasetLoaded{load.name, load.load, load.load, BlockSummary(), bytes, stamp_, IsPart(load.name) ? nullptr : ThreeChannels()});
  }
  Actions LoadedAll(std::size_t from = 0) {
    Actions actions;
    for (std::size_t i = from; i < script.loads.size(); ++i) CoordinatorScript::Append(actions, Loaded(LoadDataset(script.loads[i])));
    return NothingChanged(std::move(actions));
  }
  Actions NothingChanged(Actions actions) {
    std::vector<CheckDatasetFiles> looks = Of<CheckDatasetFiles>(actions);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      const Actions more = script.Step(DatasetSeen{looks[i].name, looks[i].load, false});
      for (const CheckDatasetFiles& look : Of<CheckDatasetFiles>(more)) looks.push_back(look);
      CoordinatorScript::Append(actions, more);
    }
    return actions;
  }
  std::vector<std::string> LoadedNames(std::size_t from = 0) const {
    std::vector<std::string> names;
    for (std::size_t i = from; i < script.loads.size(); ++i) names.push_back(script.loads[i].name);
    return names;
  }
  static std::vector<std::string> Failures(const Actions& actions) {
    std::vector<std::string> failures;
    for (const auto& failed : ToClients<FrameFailed>(actions)) failures.push_back(failed.message.status.message());
    return failures;
  }

  CoordinatorScript script;
  std::shared_ptr<const FileStamp> stamp_ = std::make_shared<const FileStamp>();
};

TEST_F(FieldRules, AFrameShowsAllChannelsOnceTheyAreThere) {
  script.Client(kClient, Showing(1, {}));
  EXPECT_THAT(LoadedNames(), ElementsAre("block"));
  EXPECT_THAT(HandedOut(NothingChanged(Loaded(LoadDataset(script.loads[0])))), IsEmpty());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 1, 0), PartName("block", 2, 0))) << "the overlay is not asked for";
  EXPECT_EQ(script.loads[1].source.path, "/named/block.tif?channel=1");
  EXPECT_THAT(HandedOut(NothingChanged(Loaded(LoadDataset(script.loads[2])))), IsEmpty());
  const std::vector<GroupAssignment> groups = HandedOut(NothingChanged(Loaded(LoadDataset(script.loads[1]))));
  ASSERT_THAT(groups, SizeIs(1));
  const FrameSetup& setup = groups[0].setup;
  EXPECT_EQ(setup.dataset, script.loads[0].load);
  ASSERT_THAT(setup.fields, SizeIs(2));
  EXPECT_EQ(setup.fields[0].levels.at(0).dataset, script.loads[1].load);
  EXPECT_EQ(setup.fields[1].levels.at(0).dataset, script.loads[2].load);
  EXPECT_EQ(setup.fields[0].look.blend, Blend::kAdd);
  EXPECT_NE(setup.transfer.colors, setup.fields[0].look.transfer.colors);
}

class FieldsInLittleMemory : public FieldRules {
 protected:
  FieldsInLittleMemory() : FieldRules(400 * kMebi) {}  // 300 MiB for voxels
};

// While a part is read, it takes memory already. What must go for it goes before that.
TEST_F(FieldsInLittleMemory, RoomIsMadeBeforeAnotherTimeIsLoaded) {
  const auto visit = [&](RequestId request, const std::string& channel, const std::string& time) {
    const std::size_t from = script.loads.size();
    Actions actions = script.Client(kClient, Showing(request, {channel}, time));
    const std::size_t unloaded = Of<UnloadDataset>(actions).size();
    for (std::size_t i = from; i < script.loads.size(); ++i)
      CoordinatorScript::Append(actions, Loaded(LoadDataset(script.loads[i]), 100 * kMebi));
    script.AnswerAll(NothingChanged(std::move(actions)));
    return unloaded;
  };
  EXPECT_EQ(visit(1, "0", "0"), 0U);
  EXPECT_EQ(visit(2, "0", "1"), 0U);
  EXPECT_EQ(visit(3, "0", "2"), 0U);
  EXPECT_EQ(visit(4, "0", "3"), 1U) << "400 MiB would be there when it is loaded";
}

TEST_F(FieldRules, EachFieldHasALightVolumeIfThereAreShadows) {
  SubmitFrame submit = Showing(1, {"0", "2"});
  submit.frame.shading.ambient_occlusion = 1;
  script.Client(kClient, submit);
  const std::vector<GroupAssignment> groups = HandedOut(LoadedAll());
  ASSERT_THAT(groups, SizeIs(1));
  const FrameSetup& setup = groups[0].setup;
  ASSERT_TRUE(setup.light);
  EXPECT_EQ(setup.light->dataset, LightVolumeOf(setup.dataset));
  ASSERT_THAT(setup.fields, SizeIs(1));
  ASSERT_TRUE(setup.fields[0].light);
  EXPECT_EQ(setup.fields[0].light->dataset, LightVolumeOf(script.loads[1].load));
}

// What the light volumes are made from is read, too: of the volume, which has levels, and of a channel with levels of its own.
TEST_F(FieldRules, AFieldOfSeveralLevelsHasACoarseOneAsItsLightVolume) {
  SubmitFrame submit = Showing(1, {"0", "1"});
  submit.frame.shading.shadows = 1;
  submit.frame.level = "0";
  script.Client(kClient, submit);
  const auto levels = std::make_shared<VolumeLevels>();
  for (const std::int32_t side : {300, 100}) {
    VolumeDescription level = BlockSummary()->description;
    level.geometry.size = {side, side, side};
    level.geometry.spacing = {300.0 / side, 300.0 / side, 300.0 / side};
    levels->levels.push_back(level);
  }
  const auto overview = std::make_shared<VolumeSummary>(*BlockSummary());
  overview->description = levels->levels[1];
  levels->overview = overview;
  Actions actions;
  for (std::size_t i = 0; i < script.loads.size(); ++i) {
    const LoadDataset load = script.loads[i];
    if (!IsLevelName(load.name)) {
      CoordinatorScript::Append(
          actions, script.Step(DatasetOpened{
                       load.name, load.load, levels, {load.source, load.source}, stamp_, IsPart(load.name) ? nullptr : ThreeChannels()}));
      continue;
    }
    auto summary = std::make_shared<VolumeSummary>(*BlockSummary());
    summary->description = levels->levels[load.name.ends_with('1') ? 1 : 0];
    summary->stored = StoredAt{.source = "/named/block.zarr", .level = 0, .version = 1, .block = {{0, 0, 0}, {64, 64, 64}}};
    CoordinatorScript::Append(actions, script.Step(DatasetLoaded{load.name, load.load, load.load, summary, 0, stamp_}));
  }
  const std::vector<GroupAssignment> groups = HandedOut(NothingChanged(std::move(actions)));
  const std::string part = PartName("block", 1, 0);
  ASSERT_THAT(LoadedNames(), testing::UnorderedElementsAre("block", part, LevelName("block", 0), LevelName("block", 1), LevelName(part, 0),
                                                           LevelName(part, 1)));
  const auto id = [&](const std::string& name) { return std::ranges::find(script.loads, name, &LoadDataset::name)->load; };
  ASSERT_THAT(groups, SizeIs(1));
  const FrameSetup& setup = groups[0].setup;
  EXPECT_EQ(setup.dataset, id(LevelName("block", 0)));
  EXPECT_EQ(setup.light.value().dataset, id(LevelName("block", 1)));
  EXPECT_EQ(setup.fields.at(0).levels.at(0).dataset, id(LevelName(part, 0)));
  EXPECT_EQ(setup.fields.at(0).light.value().dataset, id(LevelName(part, 1)));
}

TEST_F(FieldRules, TheFirstChannelThatShowsIsTheVolume) {
  script.Client(kClient, Showing(1, {"GFP", "1"}));
  const std::vector<GroupAssignment> groups = HandedOut(LoadedAll());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 1, 0), PartName("block", 2, 0)));
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.dataset, script.loads[1].load);
  ASSERT_THAT(groups[0].setup.fields, SizeIs(1));
  EXPECT_EQ(groups[0].setup.fields[0].levels.at(0).dataset, script.loads[2].load);
}

TEST_F(FieldRules, AnOverlayCoversTheVolumeAndIsReadFromItsOwnFile) {
  SubmitFrame submit = Showing(1, {"0"});
  submit.frame.transfer.choice = "ct-bone";
  submit.frame.fields = {{.field = "overlay", .choice = "hot", .weight = 0.5}};
  script.Client(kClient, submit);
  const std::vector<GroupAssignment> groups = HandedOut(LoadedAll());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 3, 0)));
  EXPECT_EQ(script.loads[1].source.path, "/named/map.nii");
  ASSERT_THAT(groups, SizeIs(1));
  ASSERT_THAT(groups[0].setup.fields, SizeIs(1));
  EXPECT_EQ(groups[0].setup.fields[0].look.blend, Blend::kOver);
  EXPECT_EQ(groups[0].setup.fields[0].look.weight, 0.5);
}

TEST_F(FieldRules, AFrameShowsOneTimeOfAllItsFields) {
  script.Client(kClient, Showing(1, {"0", "2"}, "3"));
  const std::vector<GroupAssignment> groups = HandedOut(LoadedAll());
  ASSERT_THAT(LoadedNames(), testing::IsSupersetOf({"block", PartName("block", 0, 3).c_str(), PartName("block", 2, 3).c_str()}));
  const auto of = [&](const std::string& name) { return std::ranges::find(script.loads, name, &LoadDataset::name); };
  EXPECT_EQ(of(PartName("block", 2, 3))->source.path, "/named/block.tif?channel=2,time=3");
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.dataset, of(PartName("block", 0, 3))->load);
  EXPECT_EQ(groups[0].setup.fields.at(0).levels.at(0).dataset, of(PartName("block", 2, 3))->load);
}

// All times of a channel are drawn by the statistics of the dataset's own time, so those are there before another time is read.
TEST_F(FieldRules, AnotherTimeIsReadWithTheStatisticsOfTheDatasetsOwn) {
  script.Client(kClient, Showing(1, {"0", "2"}, "3"));
  NothingChanged(Loaded(LoadDataset(script.loads[0])));
  ASSERT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 2, 0)));
  NothingChanged(Loaded(LoadDataset(script.loads[1])));
  ASSERT_THAT(LoadedNames(2), ElementsAre(PartName("block", 0, 3), PartName("block", 2, 3)));
  for (const LoadDataset& load : script.loads) EXPECT_EQ(load.source.statistics != nullptr, load.name.ends_with(" time 3")) << load.name;
  script.AnswerAll(LoadedAll(2));
  script.Client(kClient, Showing(2, {"2"}, "4"));
  ASSERT_THAT(LoadedNames(4), ElementsAre(PartName("block", 2, 4))) << "its statistics are known";
  EXPECT_NE(script.loads[4].source.statistics, nullptr);
}

// A question about another time comes first: a later picture of it is drawn by the same statistics all the same.
TEST_F(FieldRules, AQuestionAboutAnotherTimeWaitsForTheStatistics) {
  script.Client(kClient, SampleQuery{.nonce = 1, .dataset = "block", .points = {{1, 1, 1}}, .channels = {"2"}, .time = "3"});
  NothingChanged(Loaded(LoadDataset(script.loads[0])));
  ASSERT_THAT(LoadedNames(1), ElementsAre(PartName("block", 2, 0)));
  LoadedAll(1);
  const auto part = std::ranges::find(script.loads, PartName("block", 2, 3), &LoadDataset::name);
  ASSERT_NE(part, script.loads.end());
  EXPECT_NE(part->source.statistics, nullptr);
}

// ---- points

TEST_F(FieldRules, APointHasTheFieldsThatTheQuestionNamesElseTheFirstAndTheOverlay) {
  std::size_t loaded = 0;
  const auto ask = [&](std::vector<std::string> channels) {
    Actions actions = NothingChanged(
        script.Client(kClient, SampleQuery{.nonce = 1, .dataset = "block", .points = {{1, 1, 1}}, .channels = std::move(channels)}));
    while (loaded < script.loads.size()) CoordinatorScript::Append(actions, NothingChanged(Loaded(LoadDataset(script.loads[loaded++]))));
    const auto asked = Of<AnswerQuestion>(actions);
    EXPECT_THAT(asked, SizeIs(1));
    std::vector<int> numbers;
    if (asked.size() != 1) return numbers;
    numbers.push_back(asked[0].fields.volume);
    for (const FieldVolume& field : asked[0].fields.others) {
      numbers.push_back(field.number);
      const auto load = std::ranges::find(script.loads, PartName("block", field.number, 0), &LoadDataset::name);
      EXPECT_EQ(field.levels.at(0).dataset, load->load);
    }
    return numbers;
  };
  EXPECT_THAT(ask({}), ElementsAre(0, 3));
  EXPECT_THAT(ask({"overlay"}), ElementsAre(3));
  EXPECT_THAT(ask({"GFP", "1"}), ElementsAre(1, 2));
  EXPECT_THAT(ask({"0", "2", "overlay"}), ElementsAre(0, 2, 3));
}

TEST_F(FieldRules, APickHasTheFieldsThatItsPictureShows) {
  PickQuery pick{.nonce = 1, .frame = Showing(1, {"0", "2"}).frame, .x = 1, .y = 1};
  script.Client(kClient, pick);
  const auto asked = Of<AnswerQuestion>(LoadedAll());
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 2, 0))) << "the overlay does not show";
  ASSERT_THAT(asked[0].fields.others, SizeIs(1));
  EXPECT_EQ(asked[0].fields.others[0].levels.at(0).dataset, script.loads[1].load);
  pick.frame.channels = {"Nil"};
  const auto refused = ToClients<OrderRefused>(NothingChanged(script.Client(kClient, pick)));
  ASSERT_THAT(refused, SizeIs(1));
  EXPECT_THAT(refused[0].message.status.message(), HasSubstr("has no field 'Nil'"));
}

// ---- times

// What has a source of its own tells how many times it has when it is opened.
TEST_F(FieldRules, AFieldWithASourceOfItsOwnHasOneTimeOrAsManyAsTheDataset) {
  const auto shown_with = [&](RequestId request, int times) {
    script.Client(kClient, Showing(request, {"0", "overlay"}, "3"));
    Actions actions;
    for (std::size_t i = 0; i < script.loads.size(); ++i) {
      const LoadDataset load = script.loads[i];
      auto fields = std::make_shared<DatasetFields>();
      fields->times.count = times;
      CoordinatorScript::Append(actions,
                                load.name == PartName("block", 3, 0)
                                    ? script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary(), 0, stamp_, fields})
                                    : Loaded(load));
    }
    return NothingChanged(std::move(actions));
  };
  const auto of = [&](const std::string& name) { return std::ranges::find(script.loads, name, &LoadDataset::name); };
  const std::vector<GroupAssignment> groups = HandedOut(shown_with(1, 5));
  ASSERT_THAT(groups, SizeIs(1));
  ASSERT_NE(of(PartName("block", 3, 3)), script.loads.end());
  EXPECT_EQ(of(PartName("block", 3, 3))->source.path, "/named/map.nii?time=3");
  EXPECT_EQ(groups[0].setup.fields.at(0).levels.at(0).dataset, of(PartName("block", 3, 3))->load);
}

TEST_F(FieldRules, AFieldWithOtherTimesThanTheDatasetIsRefusedInOneLine) {
  script.Client(kClient, Showing(1, {"0", "overlay"}, "3"));
  Actions actions = Loaded(LoadDataset(script.loads[0]));
  ASSERT_EQ(LoadedNames().back(), PartName("block", 3, 0));
  const LoadDataset load = script.loads.back();
  CoordinatorScript::Append(actions, script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary(), 0, stamp_,
                                                               std::make_shared<DatasetFields>(DatasetFields{.times = {.count = 7}})}));
  EXPECT_THAT(Failures(NothingChanged(std::move(actions))),
              ElementsAre("field 'overlay' of dataset \"block\" has 7 times, must have one or 5, as the dataset"));
}

// The newest time is that of now: what is known of the dataset is not enough until its files have been looked at.
TEST_F(FieldRules, TheLastTimeIsThatOfTheFilesAsTheyAre) {
  script.Client(kClient, Showing(1, {"0"}, "0"));
  script.AnswerAll(LoadedAll());
  const std::size_t before = script.loads.size();
  const Actions looks = script.Client(kClient, Showing(2, {"0"}, "last"));
  EXPECT_THAT(LoadedNames(before), IsEmpty());
  const std::vector<CheckDatasetFiles> asked = Of<CheckDatasetFiles>(looks);
  ASSERT_THAT(asked, SizeIs(1));
  script.Step(DatasetSeen{asked[0].name, asked[0].load, true});
  ASSERT_THAT(LoadedNames(before), ElementsAre("block")) << "a time has come";
  const auto grown = std::make_shared<DatasetFields>(*ThreeChannels());
  grown->times.count = 6;
  const LoadDataset load = script.loads.back();
  Actions actions = script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary(), 0, stamp_, grown});
  actions = NothingChanged(std::move(actions));
  EXPECT_THAT(LoadedNames(before + 1), ElementsAre(PartName("block", 0, 5)));
}

class NoVoxels : public VolumeSource {
 public:
  const SourceInfo& info() const override { return info_; }
  void Read(int, const Box&, const BoxRoom&, std::stop_token, ReadDone done) override { done(Status::Ok()); }
  Counts counts() const override { return {}; }

 private:
  const SourceInfo info_;
};

TEST_F(FieldRules, OtherTimesAndChannelsAreOpenedBesideWhatIsOpen) {
  script.Client(kClient, Showing(1, {"0", "1", "overlay"}, "3"));
  const auto answer = [&](std::size_t load, std::shared_ptr<VolumeSource> opened) {
    const LoadDataset begun = script.loads.at(load);
    NothingChanged(script.Step(DatasetLoaded{begun.name, begun.load, begun.load, BlockSummary(), 0, stamp_,
                                             load == 0 ? ThreeChannels() : nullptr, std::move(opened)}));
  };
  const auto of_dataset = std::make_shared<NoVoxels>(), of_channel = std::make_shared<NoVoxels>();
  EXPECT_EQ(script.loads.at(0).source.beside, nullptr);
  answer(0, of_dataset);
  ASSERT_THAT(LoadedNames(1), ElementsAre(PartName("block", 1, 0), PartName("block", 3, 0)));
  EXPECT_EQ(script.loads[1].source.beside, of_dataset);
  EXPECT_EQ(script.loads[2].source.beside, nullptr) << "the overlay lies elsewhere";
  answer(1, of_channel);
  answer(2, nullptr);
  ASSERT_THAT(LoadedNames(3), ElementsAre(PartName("block", 0, 3), PartName("block", 1, 3)));
  EXPECT_EQ(script.loads[3].source.beside, of_dataset);
  EXPECT_EQ(script.loads[4].source.beside, of_channel);
}

TEST_F(FieldRules, WhoAsksForTheStatusHearsOfNewTimes) {
  script.Client(kClient, Showing(1, {"0"}, "0"));
  script.AnswerAll(LoadedAll());
  script.Pass(seconds(30));
  const Actions looks = script.Client(kClient, StatusQuery{});
  const std::vector<CheckDatasetFiles> asked = Of<CheckDatasetFiles>(looks);
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_THAT(Of<CheckDatasetFiles>(script.Client(kClient, StatusQuery{})), IsEmpty()) << "not at each question";
  const std::size_t before = script.loads.size();
  script.Step(DatasetSeen{asked[0].name, asked[0].load, true});
  EXPECT_THAT(LoadedNames(before), ElementsAre("block")) << "though nobody asks for a picture";
}

// A movie is framed by all that it shows, as a picture is.
TEST_F(FieldRules, AQuestionAboutTheViewKnowsAllFieldsThatShow) {
  script.Client(kClient, ViewQuery{.nonce = 1, .frame = Showing(1, {"0", "2", "overlay"}).frame});
  const std::vector<AnswerQuestion> asked = Of<AnswerQuestion>(LoadedAll());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", PartName("block", 2, 0), PartName("block", 3, 0)));
  ASSERT_THAT(asked, SizeIs(1));
  ASSERT_THAT(asked[0].fields.others, SizeIs(2));
  for (const FieldVolume& field : asked[0].fields.others) {
    ASSERT_THAT(field.levels, SizeIs(1));
    EXPECT_EQ(field.levels[0].summary->description, BlockSummary()->description);
  }
}

// Movies of any number of times: what was shown long ago is closed, what a frame waits for is not.
TEST_F(FieldRules, FieldsAtManyTimesAreClosedAgain) {
  const auto many = std::make_shared<DatasetFields>(*ThreeChannels());
  many->times.count = 10 * int(kMostParts);
  script.Client(kClient, Showing(1, {"0"}, "1"));
  const LoadDataset block = script.loads[0];
  Actions actions = script.Step(DatasetLoaded{block.name, block.load, block.load, BlockSummary(), 0, stamp_, many});
  std::size_t unloaded = 0;
  for (int time = 1; time < int(kMostParts) + 20; ++time) {
    if (time > 1) actions = script.Client(kClient, Showing(RequestId(time), {"0"}, std::to_string(time)));
    const LoadDataset load = script.loads.back();
    ASSERT_EQ(load.name, PartName("block", 0, time));
    CoordinatorScript::Append(actions, Loaded(load));
    actions = NothingChanged(std::move(actions));
    ASSERT_THAT(HandedOut(actions), SizeIs(1)) << time;
    actions = script.AnswerAll(std::move(actions));
    unloaded += Of<UnloadDataset>(actions).size();
  }
  EXPECT_GE(unloaded, 10U);
  const std::size_t before = script.loads.size();
  script.Client(kClient, Showing(9999, {"0"}, "1"));
  EXPECT_THAT(LoadedNames(before), ElementsAre(PartName("block", 0, 1))) << "it is read again";
}

TEST_F(FieldRules, WhatIsNotThereIsRefusedInOneLine) {
  LoadedAll();
  const auto refusal = [&](const SubmitFrame& submit) {
    const std::size_t before = script.loads.size();
    Actions actions = script.Client(kClient, submit);
    CoordinatorScript::Append(actions, LoadedAll(before));
    const std::vector<std::string> failures = Failures(actions);
    return failures.size() == 1 ? failures[0] : "no refusal";
  };
  EXPECT_EQ(refusal(Showing(1, {"DAPY"})),
            "dataset \"block\" has no field 'DAPY': it has 0 (DAPI), 1 (Actin), 2 (GFP), 3 (overlay); did you mean 'DAPI'?");
  EXPECT_THAT(refusal(Showing(2, {"7"})), HasSubstr("has no field '7'"));
  EXPECT_EQ(refusal(Showing(3, {}, "5")), "time is '5', but dataset \"block\" has times 0 to 4");
  EXPECT_THAT(refusal(Showing(4, {}, "2.5s")), HasSubstr("does not tell when its times were"));
  EXPECT_THAT(refusal(Showing(5, {}, "soon")), HasSubstr("a number with a unit such as 3.5s, or last"));
  SubmitFrame transfer = Showing(6, {});
  transfer.frame.transfer.choice = "ct-bone";
  EXPECT_THAT(refusal(transfer), HasSubstr("transfer is that of one channel, but 3 of dataset \"block\" show"));
  SubmitFrame splat = Showing(7, {});
  splat.frame.renderer = "splat";
  EXPECT_THAT(refusal(splat), HasSubstr("renderer is 'splat', but a picture of 3 fields needs one of: raycast"));
}

TEST_F(FieldRules, AFieldThatCannotBeReadFailsTheFrameInOneLineThatNamesIt) {
  script.Client(kClient, Showing(1, {}));
  NothingChanged(Loaded(LoadDataset(script.loads[0])));
  ASSERT_THAT(script.loads, SizeIs(3));
  const Actions actions =
      script.Step(DatasetFailed{script.loads[2].name, script.loads[2].load, Status::Unavailable("the store does not answer")});
  ASSERT_THAT(Failures(actions), SizeIs(1));
  EXPECT_THAT(Failures(actions)[0], HasSubstr("the store does not answer"));
}

TEST_F(FieldRules, IfAFileChangesAllFieldsAreReadAnew) {
  script.Client(kClient, Showing(1, {}));
  script.AnswerAll(LoadedAll());
  const std::size_t before = script.loads.size();
  const Actions looks = script.Client(kClient, Showing(2, {}));
  ASSERT_FALSE(Of<CheckDatasetFiles>(looks).empty());
  const CheckDatasetFiles look = Of<CheckDatasetFiles>(looks).back();
  EXPECT_TRUE(IsPart(look.name));
  script.Step(DatasetSeen{look.name, look.load, true});
  ASSERT_THAT(LoadedNames(before), ElementsAre("block"));
  const std::vector<GroupAssignment> groups = HandedOut(LoadedAll(before));
  EXPECT_THAT(LoadedNames(before), ElementsAre("block", PartName("block", 1, 0), PartName("block", 2, 0)));
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.dataset, script.loads[before].load);
}

}  // namespace
}  // namespace slabstream
