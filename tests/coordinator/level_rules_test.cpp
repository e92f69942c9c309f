// What the coordinator does about datasets with several levels, told as scripts.
#include "common/planning/levels.h"

#include "common/view/default_view.h"
#include "common/volume/memory_budget.h"
#include "tests/coordinator/coordinator_script.h"

namespace slabstream {
namespace {

constexpr int kLevels = 3;

VolumeGeometry GeometryOfLevel(int level) {
  const std::int32_t step = 1 << level;
  VolumeGeometry geometry{{32 / step, 32 / step, 48 / step}, {double(step), double(step), double(step)}};
  const double first = 0.5 * (step - 1);
  geometry.orientation.origin = {first, first, first};
  return geometry;
}

std::shared_ptr<const VolumeSummary> SummaryOfLevel(int level) {
  auto summary = std::make_shared<VolumeSummary>(*BlockSummary());
  summary->description.geometry = GeometryOfLevel(level);
  summary->brick_counts = CubesOver(GeometryOfLevel(level).size, kBrick);
  summary->bricks.assign(CountIn(summary->brick_counts), {255, 255});
  return summary;
}

std::shared_ptr<const VolumeLevels> Levels() {
  auto levels = std::make_shared<VolumeLevels>();
  for (int level = 0; level < kLevels; ++level) levels->levels.push_back({.geometry = GeometryOfLevel(level)});
  levels->overview = SummaryOfLevel(kLevels - 1);
  return levels;
}

SubmitFrame AtLevelFrame(RequestId request, const std::string& level, const std::string& dataset = "block") {
  SubmitFrame submit = Frame(request, 1, dataset);
  submit.frame.level = level;
  return submit;
}

class LevelRules : public testing::Test {
 protected:
  static ScriptConfig Config(std::uint64_t memory_bytes = 0) {
    ScriptConfig config = TestConfig();
    config.datasets = {{"block", DataSource("/named/block.ome.zarr", "")}, {"other", DataSource("/named/other.ome.zarr", "")}};
    config.memory_bytes = memory_bytes;
    return config;
  }
  explicit LevelRules(std::uint64_t memory_bytes = 0) : script(Config(memory_bytes)) { script.Join(11, 1); }

  // The end of the load that was begun last, of a dataset.
  Actions Opened() {
    const LoadDataset load = script.loads.back();
    EXPECT_FALSE(IsLevelName(load.name));
    std::vector<DataSource> sources;
    for (int level = 0; level < kLevels; ++level) sources.emplace_back(load.name + " at level " + std::to_string(level), "");
    return script.Step(DatasetOpened{load.name, load.load, Levels(), std::move(sources), stamp_});
  }
  // Likewise, of a level. Each load has voxels of its own.
  Actions Loaded(std::uint64_t bytes = 0) { return Loaded(script.loads.back(), bytes); }
  Actions Loaded(const LoadDataset& load, std::uint64_t bytes = 0) {
    EXPECT_TRUE(IsLevelName(load.name));
    const int level = load.name.back() - '0';
    return script.Step(DatasetLoaded{load.name, load.load, load.load, SummaryOfLevel(level), bytes, stamp_});
  }
  Actions Seen(const CheckDatasetFiles& look, Result<bool> changed) {
    return script.Step(DatasetSeen{look.name, look.load, std::move(changed)});
  }
  // No file has changed, whatever is looked at from `actions` on. All actions, with `actions` first.
  Actions NothingChanged(Actions actions) {
    std::vector<CheckDatasetFiles> looks = Of<CheckDatasetFiles>(actions);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      const Actions more = Seen(looks[i], false);
      for (const CheckDatasetFiles& look : Of<CheckDatasetFiles>(more)) looks.push_back(look);
      CoordinatorScript::Append(actions, more);
    }
    return actions;
  }
  // A frame of a level, until it is done. Answers all loads and looks.
  Actions Visit(const SubmitFrame& submit, std::uint64_t bytes = 0) {
    const std::size_t before = script.loads.size();
    Actions actions = script.Client(kClient, submit);
    for (std::size_t i = before; i < script.loads.size(); ++i) {
      CoordinatorScript::Append(actions, IsLevelName(script.loads[i].name) ? Loaded(script.loads[i], bytes) : Opened());
    }
    return script.AnswerAll(NothingChanged(std::move(actions)));
  }
  std::vector<std::string> LoadedNames(std::size_t from = 0) const {
    std::vector<std::string> names;
    for (std::size_t i = from; i < script.loads.size(); ++i) names.push_back(script.loads[i].name);
    return names;
  }
  static CheckDatasetFiles LookAt(const Actions& actions, const std::string& name) {
    for (const CheckDatasetFiles& look : Of<CheckDatasetFiles>(actions)) {
      if (look.name == name) return look;
    }
    ADD_FAILURE() << "the files of " << name << " are not looked at";
    return {};
  }
  static std::vector<Status> Failures(const Actions& actions) {
    std::vector<Status> failures;
    for (const auto& failed : ToClients<FrameFailed>(actions)) failures.push_back(failed.message.status);
    return failures;
  }

  CoordinatorScript script;
  std::shared_ptr<const FileStamp> stamp_ = std::make_shared<const FileStamp>();
};

TEST_F(LevelRules, ADatasetIsOpenedAndTheLevelThatARequestDrawsIsLoaded) {
  script.Client(kClient, AtLevelFrame(1, "1"));
  EXPECT_THAT(LoadedNames(), ElementsAre("block"));
  EXPECT_THAT(HandedOut(Opened()), IsEmpty());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", LevelName("block", 1)));
  EXPECT_EQ(script.loads.back().source.path, "block at level 1");
  const std::vector<GroupAssignment> groups = HandedOut(NothingChanged(Loaded()));
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.dataset, script.loads.back().load);
  EXPECT_EQ(groups[0].setup.description.geometry, GeometryOfLevel(1));
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(script.Answer(groups[0]))), SizeIs(1));
  // It is there for the next one, and the dataset is not opened again for another level.
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(2, "1"))), SizeIs(1));
  EXPECT_THAT(LoadedNames(2), IsEmpty());
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(3, "2"))), SizeIs(1));
  EXPECT_THAT(LoadedNames(2), ElementsAre(LevelName("block", 2)));
}

TEST_F(LevelRules, DetailChoosesTheLevel) {
  SubmitFrame submit = Frame(1);  // of 64 pixels, about one voxel of level 0 wide
  for (const auto& [detail, level] : {std::pair(1.0, 0), std::pair(2.5, 1), std::pair(9.0, 2)}) {
    const std::size_t before = script.loads.size();
    submit.frame.detail = detail;
    ++submit.request;
    EXPECT_THAT(ToClients<FrameReply>(Visit(submit)), SizeIs(1));
    EXPECT_EQ(LoadedNames(before).back(), LevelName("block", level));
  }
}

// One looks down on the volume from close by: its upper third is drawn from level 0, the rest from level 1.
SubmitFrame FromAbove(RequestId request) {
  SubmitFrame submit = Frame(request);
  submit.frame.renderer = "raycast";
  submit.frame.view = {.projection = Projection::kPerspective, .elevation_degrees = 90, .fov_degrees = 60, .distance = 31};
  submit.frame.detail = 5.5;
  return submit;
}

TEST_F(LevelRules, AFrameWaitsForAllLevelsThatItIsDrawnFrom) {
  script.Client(kClient, FromAbove(1));
  EXPECT_THAT(HandedOut(Opened()), IsEmpty());
  ASSERT_THAT(LoadedNames(), ElementsAre("block", LevelName("block", 0), LevelName("block", 1)));
  const LoadDataset fine = script.loads[1], coarse = script.loads[2];
  EXPECT_THAT(HandedOut(NothingChanged(Loaded(coarse))), IsEmpty());
  const Actions begun = NothingChanged(Loaded(fine));
  const std::vector<GroupAssignment> groups = HandedOut(begun);
  ASSERT_THAT(groups, testing::Not(IsEmpty()));
  const FrameSetup& setup = groups[0].setup;
  EXPECT_EQ(setup.dataset, fine.load);
  EXPECT_EQ(setup.description.geometry, GeometryOfLevel(0));
  ASSERT_THAT(setup.coarser, SizeIs(1));
  EXPECT_EQ(setup.coarser[0].dataset, coarse.load);
  EXPECT_EQ(setup.coarser[0].description.geometry, GeometryOfLevel(1));
  for (const Placement& placement : groups[0].group.placements) EXPECT_EQ(placement.level, placement.box.begin.z < 32 ? 1 : 0);
  EXPECT_EQ(Of<UnloadDataset>(script.Client(kOther, DataOrder{.action = DataAction::kRemove, .items = {"block"}})).size(), 0U)
      << "a frame that has begun keeps all of its voxels";
  std::vector<DatasetId> unloaded;
  for (const UnloadDataset& unload : Of<UnloadDataset>(script.AnswerAll(begun))) unloaded.push_back(unload.dataset);
  EXPECT_THAT(unloaded, testing::UnorderedElementsAre(fine.load, coarse.load));
}

TEST_F(LevelRules, FilesOfAnyLevelOfAFrameThatChangeRenewThemAll) {
  Visit(FromAbove(1));
  const std::size_t before = script.loads.size();
  const Actions actions = script.Client(kClient, FromAbove(2));
  EXPECT_THAT(HandedOut(Seen(LookAt(actions, LevelName("block", 0)), false)), IsEmpty()) << "the other level is looked at, too";
  Seen(LookAt(actions, LevelName("block", 1)), true);
  EXPECT_THAT(LoadedNames(before), ElementsAre("block"));
  Opened();
  ASSERT_THAT(LoadedNames(before), ElementsAre("block", LevelName("block", 0), LevelName("block", 1)));
  Actions loaded = Loaded(script.loads[before + 1]);
  CoordinatorScript::Append(loaded, Loaded(script.loads[before + 2]));
  EXPECT_THAT(HandedOut(NothingChanged(loaded)), testing::Not(IsEmpty()));
}

TEST_F(LevelRules, AFrameShowsTheSameViewAtEveryLevel) {
  SubmitFrame submit = Frame(1);
  submit.frame.clipping.slab = ClipSlab{.index = 20, .thickness = 8};
  std::vector<FrameSetup> setups;
  for (int level = 0; level < kLevels; ++level) {
    submit.frame.level = std::to_string(level);
    ++submit.request;
    const std::vector<GroupAssignment> groups = HandedOut(Visit(submit));
    ASSERT_THAT(groups, SizeIs(1));
    setups.push_back(groups[0].setup);
    const ClipRegion clip = MakeClipRegion(submit.frame.clipping, GeometryOfLevel(0)).value();
    ASSERT_THAT(setups.back().clip.sides, SizeIs(2));
    const Camera& camera = setups.back().camera;
    const double step = 1 << level;
    const Vec3 voxel = Vec3{(5 - 0.5 * (step - 1)) / step, (7 - 0.5 * (step - 1)) / step, (22 - 0.5 * (step - 1)) / step};
    const Camera::ImagePoint first = setups[0].camera.Project({5, 7, 22}), at = camera.Project(voxel);
    EXPECT_NEAR(at.x / camera.supersample, first.x / setups[0].camera.supersample, 1e-9);
    EXPECT_NEAR(at.y / camera.supersample, first.y / setups[0].camera.supersample, 1e-9);
    for (std::size_t side = 0; side < 2; ++side) {
      EXPECT_NEAR(setups.back().clip.sides[side].Distance(voxel), clip.sides[side].Distance({5, 7, 22}), 1e-9);
    }
  }
}

TEST_F(LevelRules, ALevelThatThereIsNotIsRefused) {
  script.Client(kClient, AtLevelFrame(1, "3"));
  const std::vector<Status> waited = Failures(Opened());
  ASSERT_THAT(waited, SizeIs(1));
  EXPECT_EQ(waited[0], Status::InvalidArgument("level is 3, but dataset \"block\" has levels 0 to 2"));
  const std::vector<Status> at_once = Failures(script.Client(kClient, AtLevelFrame(2, "7")));
  ASSERT_THAT(at_once, SizeIs(1));
  EXPECT_THAT(at_once[0].message(), HasSubstr("has levels 0 to 2"));
  EXPECT_THAT(LoadedNames(), ElementsAre("block"));
  EXPECT_EQ(script.machine.sizes().uses, 0U);
  // A dataset without levels.
  script.Client(kClient, AtLevelFrame(3, "1", "other"));
  const LoadDataset load = script.loads.back();
  const std::vector<Status> single = Failures(script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary()}));
  ASSERT_THAT(single, SizeIs(1));
  EXPECT_EQ(single[0], Status::InvalidArgument("level is 1, but dataset \"other\" has level 0 alone"));
}

TEST_F(LevelRules, NamesOfLevelsAreNoDatasets) {
  Visit(AtLevelFrame(1, "1"));
  const std::string name = LevelName("block", 1);
  const std::vector<Status> frame = Failures(script.Client(kClient, Frame(2, 1, name)));
  ASSERT_THAT(frame, SizeIs(1));
  EXPECT_EQ(frame[0].code(), StatusCode::kNotFound);
  const auto question = ToClients<OrderRefused>(script.Client(kClient, SampleQuery{.dataset = name, .points = {{1, 2, 3}}}));
  ASSERT_THAT(question, SizeIs(1));
  EXPECT_EQ(question[0].message.status.code(), StatusCode::kNotFound);
  for (const DataAction action : {DataAction::kRemove, DataAction::kReload}) {
    EXPECT_THAT(ToClients<DataReply>(script.Client(kOther, DataOrder{.action = action, .items = {name}})), IsEmpty()) << int(action);
  }
  EXPECT_THAT(script.QueryStatus().datasets, SizeIs(2)) << "a status has datasets, not levels";
}

// ---------------------------------------------------------------- previews from coarse levels

SubmitFrame WithPreviews(RequestId request, const std::string& dataset = "block") {
  SubmitFrame submit = Frame(request, 1, dataset);
  submit.frame.previews = true;
  return submit;
}

class CoarsePreviews : public LevelRules {
 protected:
  // Level 0, which stays where it is.
  Actions LoadedInParts(const LoadDataset& load) {
    auto summary = std::make_shared<VolumeSummary>(*SummaryOfLevel(0));
    summary->stored = StoredAt{.source = "block.ome.zarr"};
    return script.Step(DatasetLoaded{load.name, load.load, load.load, summary, 0, stamp_});
  }
  static std::vector<Index3> SizesOf(const Actions& actions) {
    std::vector<Index3> sizes;
    for (const GroupAssignment& group : HandedOut(actions)) sizes.push_back(group.setup.description.geometry.size);
    return sizes;
  }
  void ExpectNothingLeft() {
    EXPECT_EQ(script.machine.sizes().uses, 0U);
    EXPECT_EQ(script.machine.sizes().queued, 0U);
    EXPECT_EQ(script.machine.sizes().running, 0U);
  }
  const Index3 fine_ = GeometryOfLevel(0).size, coarse_ = GeometryOfLevel(2).size;
};

TEST_F(CoarsePreviews, ComeWhileTheLevelOfThePictureIsRead) {
  script.Client(kClient, WithPreviews(1));
  Opened();
  ASSERT_THAT(LoadedNames(), ElementsAre("block", LevelName("block", 2), LevelName("block", 0)));
  const Actions begun = NothingChanged(Loaded(script.loads[1]));
  ASSERT_THAT(SizesOf(begun), ElementsAre(coarse_));
  const auto preview = ToClients<FrameReply>(script.Answer(HandedOut(begun)[0]));
  ASSERT_THAT(preview, SizeIs(1));
  EXPECT_EQ(preview[0].message.request, 1U);
  EXPECT_EQ(preview[0].message.groups_done, 0U);
  EXPECT_EQ(preview[0].message.group_count, 1U);
  EXPECT_EQ(script.QueryStatus().frames_done, 0U) << "the request goes on";
  const Actions followed = NothingChanged(Loaded(script.loads[2]));
  ASSERT_THAT(SizesOf(followed), ElementsAre(fine_));
  const auto picture = ToClients<FrameReply>(script.Answer(HandedOut(followed)[0]));
  ASSERT_THAT(picture, SizeIs(1));
  EXPECT_EQ(picture[0].message.groups_done, 1U);
  EXPECT_EQ(script.QueryStatus().frames_done, 1U);
  ExpectNothingLeft();
}

TEST_F(CoarsePreviews, DoNotComeIfThePictureIsQuickOrThereFirst) {
  script.Client(kClient, WithPreviews(1));
  Opened();
  const Actions begun = NothingChanged(Loaded(script.loads[2]));
  EXPECT_THAT(SizesOf(begun), ElementsAre(fine_));
  EXPECT_THAT(SizesOf(NothingChanged(Loaded(script.loads[1]))), IsEmpty()) << "voxels in memory need no preview from a coarse level";
  EXPECT_THAT(ToClients<FrameReply>(script.Answer(HandedOut(begun)[0])), SizeIs(1));
  const Actions at_once = Visit(WithPreviews(2));
  EXPECT_THAT(SizesOf(at_once), ElementsAre(fine_));
  EXPECT_THAT(ToClients<FrameReply>(at_once), SizeIs(1));
  script.Client(kClient, WithPreviews(3, "other"));
  const LoadDataset load = script.loads.back();
  EXPECT_THAT(HandedOut(NothingChanged(script.Step(DatasetLoaded{load.name, load.load, load.load, BlockSummary()}))), SizeIs(1))
      << "a dataset without levels";
}

TEST_F(CoarsePreviews, ComeWhileThePictureIsReadInParts) {
  script.Client(kClient, WithPreviews(1));
  Opened();
  const Actions quick = NothingChanged(Loaded(script.loads[1])), slow = NothingChanged(LoadedInParts(script.loads[2]));
  ASSERT_THAT(SizesOf(quick), ElementsAre(coarse_));
  ASSERT_THAT(SizesOf(slow), ElementsAre(fine_)) << "they run at the same time";
  const auto picture = ToClients<FrameReply>(script.Answer(HandedOut(slow)[0]));
  ASSERT_THAT(picture, SizeIs(1));
  EXPECT_EQ(picture[0].message.groups_done, 1U) << "the picture was there first";
  EXPECT_THAT(ToClients<FrameReply>(script.Answer(HandedOut(quick)[0])), IsEmpty());
  ExpectNothingLeft();
}

TEST_F(CoarsePreviews, ComeBeforeFramesThatNeedTheMemory) {
  script.Client(kClient, WithPreviews(1));
  Opened();
  EXPECT_THAT(SizesOf(NothingChanged(LoadedInParts(script.loads[2]))), IsEmpty()) << "the frame waits for the level of its preview";
  const Actions begun = NothingChanged(Loaded(script.loads[1]));
  EXPECT_THAT(SizesOf(begun), ElementsAre(coarse_, fine_));
  script.AnswerAll(begun);
  ExpectNothingLeft();
  script.Client(kClient, WithPreviews(2, "other"));
  Opened();
  EXPECT_THAT(SizesOf(NothingChanged(LoadedInParts(script.loads[5]))), IsEmpty());
  const LoadDataset coarse = script.loads[4];
  EXPECT_THAT(SizesOf(NothingChanged(script.Step(DatasetFailed{coarse.name, coarse.load, Status::DataLoss("damaged")}))),
              ElementsAre(fine_))
      << "or for its end";
}

TEST_F(CoarsePreviews, EndWithTheirRequestAndFailSilently) {
  script.Client(kClient, WithPreviews(1));
  Opened();
  ASSERT_THAT(SizesOf(NothingChanged(Loaded(script.loads[1]))), ElementsAre(coarse_));
  ASSERT_THAT(SizesOf(NothingChanged(LoadedInParts(script.loads[2]))), ElementsAre(fine_));
  EXPECT_THAT(Failures(script.Client(kClient, CancelFrame{.request = 1})), SizeIs(1));
  ExpectNothingLeft();
  script.Client(kClient, WithPreviews(2, "other"));
  const LoadDataset load = script.loads.back();
  EXPECT_THAT(Failures(script.Step(DatasetFailed{load.name, load.load, Status::DataLoss("damaged")})), SizeIs(1));
  ExpectNothingLeft();
}

// ---------------------------------------------------------------- memory

// Of 512 x 512 x 768 voxels at level 0, in one group: 384 MiB with what renderers make of them, a worker has room for 120.
class LevelsThatFit : public LevelRules {
 protected:
  LevelsThatFit() {
    FakeWorker worker{.token = 12, .incarnation = 2};
    Register message = CoordinatorScript::RegisterOf(worker);
    message.memory_bytes = kIdleMemoryBytes + (std::uint64_t{120} << 20);
    worker.id = ToWorkers<Welcome>(script.Worker(worker, message)).at(0).message.worker;
    script.tokens[worker.id] = worker.token;
    script.workers.push_back(worker);
  }
  static std::shared_ptr<const VolumeSummary> LargeSummary(int level) {
    VolumeDescription description{.geometry = GeometryOfLevel(level)};
    description.geometry.size = 16 * description.geometry.size;
    return std::make_shared<const VolumeSummary>(UnreadSummary(description, *BlockSummary()));
  }
  // Opens the dataset and loads whatever level is sought, until a frame is planned or refused.
  Actions Settle(Actions actions) {
    for (std::size_t next = 0; next < script.loads.size(); ++next) {
      const LoadDataset load = script.loads[next];
      if (IsLevelName(load.name)) {
        const auto summary = LargeSummary(load.name.back() - '0');
        CoordinatorScript::Append(actions, NothingChanged(script.Step(DatasetLoaded{load.name, load.load, load.load, summary, 0, stamp_})));
        continue;
      }
      auto levels = std::make_shared<VolumeLevels>();
      for (int level = 0; level < kLevels; ++level) levels->levels.push_back(LargeSummary(level)->description);
      levels->overview = LargeSummary(kLevels - 1);
      std::vector<DataSource> sources(kLevels, DataSource("a level", ""));
      CoordinatorScript::Append(actions, script.Step(DatasetOpened{load.name, load.load, levels, std::move(sources), stamp_}));
    }
    return actions;
  }
};

TEST_F(LevelsThatFit, AFrameThatDoesNotFitNamesTheLevelThatWould) {
  const std::vector<Status> failed = Failures(Settle(script.Client(kClient, AtLevelFrame(1, "0"))));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(failed[0].message(), HasSubstr("limit 312 MiB"));
  EXPECT_THAT(failed[0].message(), HasSubstr("--level 1 would fit, and --detail auto chooses such a level"));
  EXPECT_EQ(script.QueryStatus().refused.too_large, 1U);
  EXPECT_EQ(script.machine.sizes().uses, 0U);
}

TEST_F(LevelsThatFit, DetailAutoDrawsTheFinestLevelThatFitsAndTellsSo) {
  SubmitFrame submit = Frame(1);
  submit.frame.view.zoom = 20;  // a voxel of level 0 is wider than a pixel
  submit.frame.detail = 0;
  const Actions actions = Settle(script.Client(kClient, submit));
  EXPECT_THAT(LoadedNames(), ElementsAre("block", LevelName("block", 0), LevelName("block", 1)));
  const std::vector<GroupAssignment> groups = HandedOut(actions);
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.description.geometry.size, 8 * Index3({32, 32, 48}));
  const auto replies = ToClients<FrameReply>(script.Answer(groups[0]));
  ASSERT_THAT(replies, SizeIs(1));
  EXPECT_THAT(replies[0].message.statistics.lowered, HasSubstr("level 1 is drawn instead of level 0"));
  EXPECT_THAT(replies[0].message.statistics.lowered, HasSubstr("limit 312 MiB"));
  EXPECT_EQ(script.machine.sizes().uses, 0U);
  // What fits is drawn as ever, and nothing is told.
  submit.request = 2;
  submit.frame.view.zoom = 2;
  const auto again = ToClients<FrameReply>(script.AnswerAll(Settle(NothingChanged(script.Client(kClient, submit)))));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0].message.statistics.lowered, "");
}

TEST_F(LevelsThatFit, AVolumeWithoutLevelsNeedsConversion) {
  script.Client(kClient, Frame(1, 1, "other"));
  const LoadDataset load = script.loads.back();
  const std::vector<Status> failed = Failures(script.Step(DatasetLoaded{load.name, load.load, load.load, LargeSummary(0)}));
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_THAT(failed[0].message(), HasSubstr("the volume has no coarser levels, which would fit: slabstream convert makes them"));
  // A picture that is too large at any level, for the only worker.
  script.Kill(script.workers.front());
  SubmitFrame huge = Frame(2, 1, "other");
  huge.frame.size = {8192, 8192};
  const std::vector<Status> too_large = Failures(script.Client(kClient, huge));
  ASSERT_THAT(too_large, SizeIs(1));
  EXPECT_THAT(too_large[0].message(), testing::Not(HasSubstr("convert")));
}

// ---------------------------------------------------------------- files

TEST_F(LevelRules, AFrameWaitsForALookAtTheLevelsFilesEvenIfTheLevelIsLoadedForIt) {
  script.Client(kClient, AtLevelFrame(1, "1"));
  Opened();
  const Actions loaded = Loaded();
  EXPECT_THAT(HandedOut(loaded), IsEmpty()) << "the source was opened before, and the files may have changed since";
  EXPECT_THAT(HandedOut(Seen(LookAt(loaded, LevelName("block", 1)), false)), SizeIs(1));
}

TEST_F(LevelRules, FilesThatChangeRenewAllLevels) {
  Visit(AtLevelFrame(1, "0"));
  Visit(AtLevelFrame(2, "1"));
  const DatasetId first = script.loads[1].load, second = script.loads[2].load;
  const std::size_t before = script.loads.size();
  Actions actions = script.Client(kClient, AtLevelFrame(3, "1"));
  EXPECT_THAT(HandedOut(actions), IsEmpty());
  actions = Seen(LookAt(actions, LevelName("block", 1)), true);
  EXPECT_THAT(LoadedNames(before), ElementsAre("block"));
  std::vector<DatasetId> unloaded;
  for (const UnloadDataset& unload : Of<UnloadDataset>(actions)) unloaded.push_back(unload.dataset);
  EXPECT_THAT(unloaded, testing::UnorderedElementsAre(first, second));
  EXPECT_THAT(HandedOut(Opened()), IsEmpty());
  ASSERT_THAT(LoadedNames(before), ElementsAre("block", LevelName("block", 1)));
  const std::vector<GroupAssignment> groups = HandedOut(NothingChanged(Loaded()));
  ASSERT_THAT(groups, SizeIs(1));
  EXPECT_EQ(groups[0].setup.dataset, script.loads.back().load);
}

TEST_F(LevelRules, FramesThatHaveBegunEndWithTheirVoxelsAndThoseThatWaitGoBackToTheDataset) {
  Visit(AtLevelFrame(1, "0"));
  const std::vector<GroupAssignment> running = HandedOut(NothingChanged(script.Client(kClient, AtLevelFrame(2, "0"))));
  ASSERT_THAT(running, SizeIs(1));
  // One waits for a level that is being loaded.
  script.Client(kOther, AtLevelFrame(1, "2"));
  const LoadDataset waited = script.loads.back();
  ASSERT_EQ(waited.name, LevelName("block", 2));
  const Actions looked = script.Client(kOther, AtLevelFrame(2, "0"));
  Seen(LookAt(looked, LevelName("block", 0)), true);
  ASSERT_EQ(script.loads.back().name, "block");
  EXPECT_EQ(script.machine.sizes().retired, 1U);
  // Nobody needs what the load brings.
  const Actions late = Loaded(waited);
  ASSERT_THAT(Of<UnloadDataset>(late), SizeIs(1));
  EXPECT_EQ(Of<UnloadDataset>(late)[0].dataset, waited.load);
  const std::size_t before = script.loads.size();
  Opened();
  EXPECT_THAT(LoadedNames(before), testing::UnorderedElementsAre(LevelName("block", 0), LevelName("block", 2)));
  Actions actions = Loaded(script.loads[before]);
  CoordinatorScript::Append(actions, Loaded(script.loads[before + 1]));
  CoordinatorScript::Append(actions, script.Answer(running[0]));
  actions = script.AnswerAll(NothingChanged(std::move(actions)));
  EXPECT_THAT(ToClients<FrameReply>(actions), SizeIs(3));
  EXPECT_EQ(script.machine.sizes().retired, 0U);
}

TEST_F(LevelRules, FilesThatAreGoneFailTheDatasetsRequests) {
  Visit(AtLevelFrame(1, "0"));
  const Actions looked = script.Client(kClient, AtLevelFrame(2, "0"));
  const Actions gone = Seen(LookAt(looked, "block"), Status::NotFound("/named/block.ome.zarr: No such file or directory"));
  ASSERT_THAT(Failures(gone), SizeIs(1));
  EXPECT_THAT(Failures(gone)[0].message(), HasSubstr("No such file"));
  EXPECT_THAT(Of<UnloadDataset>(gone), SizeIs(1));
  EXPECT_THAT(Seen(LookAt(looked, LevelName("block", 0)), Status::NotFound("gone")), IsEmpty()) << "that level is no more";
  const std::size_t before = script.loads.size();
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(3, "0"))), SizeIs(1)) << "they are there again";
  EXPECT_THAT(LoadedNames(before), ElementsAre("block", LevelName("block", 0)));
}

TEST_F(LevelRules, ARemovedDatasetTakesItsLevelsAndThoseWhoWaitForThemWithIt) {
  Visit(AtLevelFrame(1, "0"));
  Visit(AtLevelFrame(2, "1"));
  script.Client(kOther, AtLevelFrame(1, "2"));
  const LoadDataset loading = script.loads.back();
  script.Client(kOther, StatisticsQuery{.nonce = 4, .dataset = "block"});
  const Actions removed = script.Client(31, DataOrder{.nonce = 1, .action = DataAction::kRemove, .items = {"block"}});
  EXPECT_THAT(Failures(removed), SizeIs(1));
  EXPECT_THAT(ToClients<OrderRefused>(removed), SizeIs(1));
  EXPECT_THAT(Of<UnloadDataset>(removed), SizeIs(2));
  EXPECT_THAT(Of<UnloadDataset>(Loaded(loading)), SizeIs(1));
  const auto sizes = script.machine.sizes();
  EXPECT_EQ(sizes.uses + sizes.questions + sizes.DatasetSizes::retired, 0U);
  EXPECT_EQ(Failures(script.Client(kClient, AtLevelFrame(9, "0"))).at(0).code(), StatusCode::kNotFound);
}

TEST_F(LevelRules, AReloadOpensTheDatasetAnew) {
  Visit(AtLevelFrame(1, "0"));
  const std::size_t before = script.loads.size();
  script.Client(31, DataOrder{.nonce = 1, .action = DataAction::kReload, .items = {"block"}});
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(2, "0"))), SizeIs(1));
  EXPECT_THAT(LoadedNames(before), ElementsAre("block", LevelName("block", 0)));
}

// ---------------------------------------------------------------- failures

TEST_F(LevelRules, ALevelThatCannotBeReadFailsItsOwnRequests) {
  Visit(AtLevelFrame(1, "0"));
  script.Client(kClient, AtLevelFrame(2, "1"));
  const LoadDataset failing = script.loads.back();
  Actions others = script.Client(kOther, AtLevelFrame(1, "0"));
  const Actions failed = script.Step(DatasetFailed{failing.name, failing.load, Status::DataLoss("1/0/0/0: damaged")});
  ASSERT_THAT(Failures(failed), SizeIs(1));
  EXPECT_EQ(ToClients<FrameFailed>(failed)[0].to, kClient);
  EXPECT_THAT(Failures(failed)[0].message(), HasSubstr("1/0/0/0: damaged"));
  EXPECT_THAT(ToClients<FrameReply>(script.AnswerAll(NothingChanged(std::move(others)))), SizeIs(1));
  // It is tried again, and the dataset stays open.
  const std::size_t before = script.loads.size();
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(3, "1"))), SizeIs(1));
  EXPECT_THAT(LoadedNames(before), ElementsAre(LevelName("block", 1)));
}

TEST_F(LevelRules, ADatasetThatCannotBeOpenedFailsAllThatWaitForIt) {
  script.Client(kClient, AtLevelFrame(1, "0"));
  script.Client(kOther, AtLevelFrame(1, "2"));
  ASSERT_THAT(script.loads, SizeIs(1));
  EXPECT_THAT(Failures(script.Step(DatasetFailed{"block", script.loads[0].load, Status::DataLoss("no multiscales")})), SizeIs(2));
  EXPECT_THAT(Opened(), IsEmpty()) << "too late";
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(2, "0"))), SizeIs(1));
}

// ---------------------------------------------------------------- memory

class LevelMemoryRules : public LevelRules {
 protected:
  LevelMemoryRules() : LevelRules(400 * kMebi) {}  // 300 for datasets
};

TEST_F(LevelMemoryRules, TheLeastRecentlyUsedLevelIsUnloaded) {
  RequestId request = 0;
  Visit(AtLevelFrame(++request, "0"), 120 * kMebi);
  Visit(AtLevelFrame(++request, "1"), 120 * kMebi);
  Visit(AtLevelFrame(++request, "0"));
  EXPECT_EQ(script.QueryStatus().datasets[0].memory_bytes, 240 * kMebi);
  const DatasetId second = script.loads.back().load;
  const Actions third = Visit(AtLevelFrame(++request, "2"), 120 * kMebi);
  EXPECT_THAT(ToClients<FrameReply>(third), SizeIs(1));
  const std::vector<UnloadDataset> unloaded = Of<UnloadDataset>(third);
  ASSERT_THAT(unloaded, SizeIs(1));
  EXPECT_EQ(unloaded[0].dataset, second);
  EXPECT_EQ(script.QueryStatus().datasets[0].state, DatasetState::kReady);
  const std::size_t before = script.loads.size();
  EXPECT_THAT(ToClients<FrameReply>(Visit(AtLevelFrame(++request, "1"), 120 * kMebi)), SizeIs(1));
  EXPECT_THAT(LoadedNames(before), ElementsAre(LevelName("block", 1))) << "the dataset stays open";
}

TEST_F(LevelMemoryRules, ALevelThatDoesNotFitIsRefusedByItsName) {
  script.Client(kClient, AtLevelFrame(1, "0"));
  Opened();
  const Actions full = Loaded(301 * kMebi);
  ASSERT_THAT(Failures(full), SizeIs(1));
  EXPECT_EQ(Failures(full)[0].code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(Failures(full)[0].message(), HasSubstr("level 0 of dataset \"block\" needs 301 MiB, limit 300 MiB"));
  EXPECT_THAT(Of<UnloadDataset>(full), SizeIs(1));
}

TEST_F(LevelMemoryRules, ALoadWithoutMemoryIsTriedAgainWhenAnotherLevelIsUnloaded) {
  Visit(AtLevelFrame(1, "0"), 120 * kMebi);
  script.Client(kClient, AtLevelFrame(2, "1"));
  const LoadDataset first = script.loads.back();
  const Actions failed = script.Step(DatasetFailed{first.name, first.load, Status::ResourceExhausted("not enough memory")});
  EXPECT_THAT(Failures(failed), IsEmpty());
  EXPECT_THAT(Of<UnloadDataset>(failed), SizeIs(1));
  ASSERT_EQ(script.loads.back().name, first.name);
  EXPECT_GT(script.loads.back().load, first.load);
  EXPECT_THAT(HandedOut(NothingChanged(Loaded(120 * kMebi))), SizeIs(1));
}

// ---------------------------------------------------------------- questions

TEST_F(LevelRules, ASummaryNeedsNoLevel) {
  script.Client(kClient, SummaryQuery{.nonce = 3, .dataset = "block"});
  const auto asked = Of<AnswerQuestion>(NothingChanged(Opened()));
  EXPECT_THAT(LoadedNames(), ElementsAre("block"));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].dataset, 0U);
  EXPECT_EQ(*asked[0].summary, StatisticsOf(*Levels()));
}

TEST_F(LevelRules, AViewNeedsNoLevel) {
  script.Client(kClient, ViewQuery{.nonce = 3, .frame = AtLevelFrame(1, "0").frame});
  const auto asked = Of<AnswerQuestion>(NothingChanged(Opened()));
  EXPECT_THAT(LoadedNames(), ElementsAre("block"));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].summary, asked[0].levels->overview);
  EXPECT_EQ(asked[0].levels->levels.front().geometry, GeometryOfLevel(0));
}

// Whichever level it is drawn from.
TEST_F(LevelRules, APictureTellsItsViewInTermsOfTheFinestLevel) {
  SubmitFrame submit = AtLevelFrame(1, "0");
  submit.frame.view = kUnstatedView;
  std::optional<ViewParameters> first;
  for (const char* level : {"0", "2"}) {
    submit.frame.level = level;
    ++submit.request;
    const auto replies = ToClients<FrameReply>(Visit(submit));
    ASSERT_THAT(replies, SizeIs(1));
    const std::optional<ViewParameters>& view = replies[0].message.statistics.view;
    ASSERT_TRUE(view);
    EXPECT_EQ(view->fit, false);
    EXPECT_TRUE(view->look_at && view->azimuth_degrees && view->elevation_degrees);
    EXPECT_EQ(*view, first.value_or(*view));
    first = view;
  }
}

TEST_F(LevelRules, QuestionsAboutVoxelsAreAnsweredFromTheFinestLevel) {
  script.Client(kClient, SampleQuery{.nonce = 3, .dataset = "block", .points = {{1, 2, 3}}});
  EXPECT_THAT(Of<AnswerQuestion>(NothingChanged(Opened())), IsEmpty());
  ASSERT_EQ(script.loads.back().name, LevelName("block", 0));
  const auto asked = Of<AnswerQuestion>(NothingChanged(Loaded()));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].dataset, script.loads.back().load);
  EXPECT_EQ(asked[0].summary->description.geometry, GeometryOfLevel(0));
}

TEST_F(LevelRules, APickIsOfTheLevelThatThePictureShows) {
  PickQuery pick{.nonce = 3, .frame = AtLevelFrame(1, "2").frame, .x = 20, .y = 30};
  script.Client(kClient, pick);
  Opened();
  ASSERT_EQ(script.loads.back().name, LevelName("block", 2));
  const auto asked = Of<AnswerQuestion>(NothingChanged(Loaded()));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].dataset, script.loads.back().load);
  EXPECT_EQ(std::get<PickQuery>(asked[0].question).frame, AtLevel(pick.frame, GeometryOfLevel(0), GeometryOfLevel(2)));
  pick.frame.level = "3";
  const auto refused = ToClients<OrderRefused>(NothingChanged(script.Client(kClient, pick)));
  ASSERT_THAT(refused, SizeIs(1));
  EXPECT_THAT(refused[0].message.status.message(), HasSubstr("has levels 0 to 2"));
}

TEST_F(LevelRules, APickHasEachChannelAtTheLevelOfTheVolume) {
  PickQuery pick{.nonce = 3, .frame = AtLevelFrame(1, "1").frame, .x = 20, .y = 30};
  pick.frame.renderer = "raycast";
  pick.frame.channels = {"0", "1"};
  script.Client(kClient, pick);
  const auto two = std::make_shared<const DatasetFields>(DatasetFields{.fields = {{.name = "a"}, {.name = "b"}}});
  Actions actions;
  for (std::size_t i = 0; i < script.loads.size(); ++i) {
    const LoadDataset load = script.loads[i];
    if (IsLevelName(load.name)) {
      CoordinatorScript::Append(actions, Loaded(load));
    } else {
      std::vector<DataSource> sources(kLevels, DataSource(load.name, ""));
      CoordinatorScript::Append(
          actions, script.Step(DatasetOpened{load.name, load.load, Levels(), std::move(sources), stamp_, i == 0 ? two : nullptr}));
    }
  }
  const auto asked = Of<AnswerQuestion>(NothingChanged(std::move(actions)));
  ASSERT_THAT(asked, SizeIs(1));
  EXPECT_EQ(asked[0].summary->description.geometry, GeometryOfLevel(1));
  ASSERT_THAT(asked[0].fields.others, SizeIs(1));
  EXPECT_EQ(asked[0].fields.others[0].levels.at(0).summary->description.geometry, GeometryOfLevel(1));
  EXPECT_THAT(LoadedNames(), testing::Not(testing::Contains(LevelName(PartName("block", 1, 0), 0)))) << "no finer voxels than are seen";
}

TEST_F(LevelRules, AnAnswerOfALevelWaitsForALookToo) {
  Visit(AtLevelFrame(1, "0"));
  const std::size_t before = script.loads.size();
  const Actions asked = script.Client(kClient, SampleQuery{.nonce = 3, .dataset = "block", .points = {{1, 2, 3}}});
  EXPECT_THAT(Of<AnswerQuestion>(asked), IsEmpty());
  EXPECT_THAT(Of<AnswerQuestion>(Seen(LookAt(asked, "block"), true)), IsEmpty());
  EXPECT_THAT(LoadedNames(before), ElementsAre("block"));
  Opened();
  EXPECT_THAT(Of<AnswerQuestion>(NothingChanged(Loaded())), SizeIs(1));
}

}  // namespace
}  // namespace slabstream
