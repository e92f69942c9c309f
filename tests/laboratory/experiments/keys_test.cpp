// A key holds all that decides the numbers of its trial: no two cases that are measured differently share one.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "data/volume_io/volume_writer.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/experiments/sweep_file.h"
#include "laboratory/experiments/walk.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

class Keys : public testing::Test {
 protected:
  TemporaryDirectory folder_;
  ExperimentContext context_{{}, OrThrow(TrialLog::Open(folder_ / "run", {"test", Json::object(), "", ""}, Resume::kSame)), {}};
};

// A field's name, and a change of it.
template <class T>
using Changes = std::vector<std::pair<std::string, std::function<void(T&)>>>;

TransferFunction& FunctionOf(TransferChoice& transfer) { return std::get<TransferFunction>(transfer.choice); }

Changes<TransferChoice> ChangesOfTransfer() {
  return {
      {"scalar range",
       [](auto& t) {
         t.scalar_range = ScalarRange{1, 2};
       }},
      {"percentiles",
       [](auto& t) {
         t.scalar_range = ScalarRange{1, 2, true};
       }},
      {"greatest scalar",
       [](auto& t) {
         t.scalar_range = ScalarRange{1, 3};
       }},
      {"isosurface",
       [](auto& t) {
         t.isosurfaces = {{1, {0, 0, 0}, 1}};
       }},
      {"isovalue",
       [](auto& t) {
         t.isosurfaces = {{2, {0, 0, 0}, 1}};
       }},
      {"isosurface's color",
       [](auto& t) {
         t.isosurfaces = {{1, {0, 0, 1}, 1}};
       }},
      {"isosurface's opacity",
       [](auto& t) {
         t.isosurfaces = {{1, {0, 0, 0}, 0.5}};
       }},
      {"gradient opacity",
       [](auto& t) {
         t.gradient_opacities = {{1, 0.5}};
       }},
      {"slope",
       [](auto& t) {
         t.gradient_opacities = {{2, 0.5}};
       }},
      {"factor",
       [](auto& t) {
         t.gradient_opacities = {{1, 0.25}};
       }},
      {"color value", [](auto& t) { FunctionOf(t).colors[1].value += 1; }},
      {"red", [](auto& t) { FunctionOf(t).colors[1].color.r += 0.01F; }},
      {"green", [](auto& t) { FunctionOf(t).colors[1].color.g += 0.01F; }},
      {"blue", [](auto& t) { FunctionOf(t).colors[1].color.b += 0.01F; }},
      {"opacity value", [](auto& t) { FunctionOf(t).opacities[1].value += 1; }},
      {"opacity", [](auto& t) { FunctionOf(t).opacities[1].opacity += 0.01; }},
      {"midpoint", [](auto& t) { FunctionOf(t).opacities[1].midpoint += 0.01; }},
      {"sharpness", [](auto& t) { FunctionOf(t).opacities[1].sharpness += 0.01; }},
      {"function's opacity distance", [](auto& t) { FunctionOf(t).opacity_distance += 1; }},
      {"opacity distance", [](auto& t) { t.opacity_distance = 2; }},
      {"preset", [](auto& t) { t.choice = "auto"; }},
      {"another preset", [](auto& t) { t.choice = "grey"; }},
  };
}

Changes<ViewParameters> ChangesOfView() {
  return {
      {"projection", [](auto& v) { v.projection = Projection::kOrthographic; }},
      {"azimuth", [](auto& v) { *v.azimuth_degrees += 1; }},
      {"elevation", [](auto& v) { *v.elevation_degrees += 1; }},
      {"roll", [](auto& v) { v.roll_degrees += 45; }},
      {"zoom", [](auto& v) { v.zoom += 0.1; }},
      {"fov", [](auto& v) { v.fov_degrees += 1; }},
  };
}

Changes<Policy> ChangesOfPartition() {
  return {
      {"decomposition", [](auto& p) { p.decomposition = "slab"; }},
      {"balance_by", [](auto& p) { p.balance_by = "occupied"; }},
      {"axis", [](auto& p) { p.axis = AxisChoice::kX; }},
      {"groups", [](auto& p) { p.groups = 3; }},
  };
}
Changes<Policy> ChangesOfOwners() {
  return {{"assignment", [](auto& p) { p.assignment = "greedy"; }}, {"balance", [](auto& p) { p.balance = "dynamic"; }}};
}
Changes<Policy> ChangesOfCombining() {
  return {{"combine", [](auto& p) { p.combine = "radix-k"; }},
          {"pixel_error", [](auto& p) { p.pixel_error = 0.001; }},
          {"teams", [](auto& p) { p.teams = 2; }}};
}

Changes<Shading> ChangesOfShading() {
  return {
      {"model", [](auto& s) { s.model = ShadingModel::kNone; }},
      {"lights",
       [](auto& s) {
         s.lights = {{1, 0, 0}};
       }},
      {"light",
       [](auto& s) {
         s.lights = {{1, 0, 1}};
       }},
      {"ambient", [](auto& s) { s.ambient = 0.3F; }},
      {"diffuse", [](auto& s) { s.diffuse = 0.7F; }},
      {"specular", [](auto& s) { s.specular = 0.3F; }},
      {"shininess", [](auto& s) { s.shininess = 30; }},
      {"shadows", [](auto& s) { s.shadows = 0.5F; }},
      {"ambient-occlusion", [](auto& s) { s.ambient_occlusion = 0.5F; }},
      {"occlusion-radius", [](auto& s) { s.occlusion_radius = 0.5F; }},
  };
}

FrameCase Example() {
  FrameCase frame{SphereCase({SphereClass::kHollow, 24, 0.1}, kTranslucentSphere), {32, 24}, {}, {}, 2};
  frame.view = {Projection::kPerspective, 30, 20, 10, 1.5, 25};
  frame.policy = {.decomposition = "kd-tree", .balance_by = "voxels", .groups = 2};
  return frame;
}

Walk WalkOf(const FrameCase& frame, int frames) { return {frame, FindPath("turntable"), frames, std::nullopt}; }

// Changes of a part, as changes of the whole.
template <class Whole, class Part>
void Add(Changes<Whole>& all, const Changes<Part>& changes, Part& (*part)(Whole&)) {
  for (const auto& [name, change] : changes) {
    all.emplace_back(name, [change = change, part](Whole& whole) { change(part(whole)); });
  }
}

TEST_F(Keys, EveryFieldOfARequestIsInItsJson) {
  using R = FrameRequest;
  Changes<R> changes = {
      {"dataset", [](R& r) { r.dataset = "other"; }},
      {"renderer", [](R& r) { r.renderer = "mip"; }},
      {"parameters",
       [](R& r) {
         r.parameters = {{"sampling-rate", "2"}};
       }},
      {"a parameter",
       [](R& r) {
         r.parameters = {{"sampling-rate", "3"}};
       }},
      {"width", [](R& r) { ++r.size.width; }},
      {"height", [](R& r) { ++r.size.height; }},
      {"termination", [](R& r) { r.termination = 0; }},
      {"previews", [](R& r) { r.previews = true; }},
      {"clip mode", [](R& r) { r.clipping.mode = ClipMode::kCutAway; }},
      {"clip box",
       [](R& r) {
         r.clipping.box = ClipBox{{0, 0, 0}, {1, 1, 1}};
       }},
      {"clip box's unit",
       [](R& r) {
         r.clipping.box = ClipBox{{0, 0, 0}, {1, 1, 1}, ClipUnit::kVoxels};
       }},
      {"clip box's bounds",
       [](R& r) {
         r.clipping.box = ClipBox{{0, 0, 0}, {1, 2, 1}};
       }},
      {"clip plane",
       [](R& r) {
         r.clipping.planes = {{{1, 0, 0}, 2}};
       }},
      {"clip plane's offset",
       [](R& r) {
         r.clipping.planes = {{{1, 0, 0}, 3}};
       }},
      {"two clip planes",
       [](R& r) {
         r.clipping.planes = {{{1, 0, 0}, 2}, {{1, 0, 0}, 3}};
       }},
      {"slab", [](R& r) { r.clipping.slab.emplace(); }},
      {"slab's normal",
       [](R& r) {
         r.clipping.slab = ClipSlab{.normal = {1, 0, 0}};
       }},
      {"slab's point",
       [](R& r) {
         r.clipping.slab = ClipSlab{.through = Vec3{1, 2, 3}};
       }},
      {"slab's index", [](R& r) { r.clipping.slab = ClipSlab{.index = 3}; }},
      {"slab's thickness", [](R& r) { r.clipping.slab = ClipSlab{.thickness = 3}; }},
  };
  Add<R, ViewParameters>(
      changes, ChangesOfView(), [](R & r) -> auto& { return r.view; });
  Add<R, TransferChoice>(
      changes, ChangesOfTransfer(), [](R & r) -> auto& { return r.transfer; });
  Add<R, Shading>(
      changes, ChangesOfShading(), [](R & r) -> auto& { return r.shading; });
  for (const auto& part : {ChangesOfPartition(), ChangesOfOwners(), ChangesOfCombining()}) {
    Add<R, Policy>(
        changes, part, [](R & r) -> auto& { return r.policy; });
  }
  std::set<std::string> seen = {RequestJson(RequestOf(Example())).dump()};
  for (const auto& [name, change] : changes) {
    FrameRequest request = RequestOf(Example());
    change(request);
    EXPECT_TRUE(seen.insert(RequestJson(request).dump()).second) << name;
  }
}

TEST_F(Keys, HoldWhatDecidesTheirNumbers) {
  enum Kind : unsigned { kBoxes = 1, kPicture = 2, kService = 4, kValidation = 8, kBalanced = 16, kWalk = 32, kAll = 63 };
  const auto keys_of = [&](const FrameCase& frame) {
    return std::vector<Json>{BoxCostKey(context_, frame),       FinishKey(context_, frame),   ServiceKey(context_, frame, 5),
                             ValidationKey(context_, frame, 7), BalancedKey(context_, frame), WalkKey(context_, WalkOf(frame, 6))};
  };
  struct Group {
    unsigned decides;
    Changes<FrameCase> changes;
  };
  using F = FrameCase;
  Group nothing{0, {{"purpose", [](F& f) { f.volume.purpose = "other"; }}}};
  Group everything{kAll,
                   {{"sphere class", [](F& f) { std::get<SphereRequest>(f.volume.volume).sphere_class = SphereClass::kFilled; }},
                    {"sphere size", [](F& f) { std::get<SphereRequest>(f.volume.volume).size = 25; }},
                    {"occupancy", [](F& f) { std::get<SphereRequest>(f.volume.volume).occupancy = 0.11; }},
                    {"renderer", [](F& f) { f.volume.renderer = ZBuffer(); }},
                    {"width", [](F& f) { ++f.size.width; }},
                    {"height", [](F& f) { ++f.size.height; }},
                    {"parameters", [](F& f) { f.look.parameters["sampling-rate"] = "2"; }},
                    {"termination", [](F& f) { f.look.termination = 0; }},
                    {"lighting", [](F& f) { f.look.shading.model = ShadingModel::kNone; }}}};
  Group views{kAll & ~kWalk, {}};  // a walk has views of its own
  Add<F, ViewParameters>(
      views.changes, ChangesOfView(), [](F & f) -> auto& { return f.view; });
  Add<F, TransferChoice>(
      everything.changes, ChangesOfTransfer(), [](F & f) -> auto& { return f.volume.transfer; });
  const auto policy = [](F& f) -> Policy& { return f.policy; };
  Group partition{kAll & ~kPicture, {{"workers", [](F& f) { f.workers = 3; }}}};
  Add<F, Policy>(partition.changes, ChangesOfPartition(), policy);
  Group owners{kAll & ~kPicture & ~kBoxes, {}};  // boxes of equal volume are the same, whoever owns them
  Add<F, Policy>(owners.changes, ChangesOfOwners(), policy);
  Group combining{kService | kValidation, {}};
  Add<F, Policy>(combining.changes, ChangesOfCombining(), policy);

  const std::vector<Json> example = keys_of(Example());
  for (const Group& group : {nothing, everything, views, partition, owners, combining}) {
    for (const auto& [name, change] : group.changes) {
      FrameCase frame = Example();
      change(frame);
      const std::vector<Json> keys = keys_of(frame);
      for (std::size_t kind = 0; kind < keys.size(); ++kind) {
        EXPECT_EQ(keys[kind] != example[kind], ((group.decides >> kind) & 1U) != 0) << name << ": " << keys[kind].dump();
      }
    }
  }
}

TEST_F(Keys, HoldHowMuchIsMeasured) {
  EXPECT_NE(ServiceKey(context_, Example(), 5), ServiceKey(context_, Example(), 6));
  EXPECT_NE(ValidationKey(context_, Example(), 5), ValidationKey(context_, Example(), 6));
  EXPECT_NE(WalkKey(context_, WalkOf(Example(), 5)), WalkKey(context_, WalkOf(Example(), 6)));
}

TEST_F(Keys, OfWalksHoldThePathTheLaterTransferFunctionAndTheVolumes) {
  const FrameCase frame = Example();
  std::set<std::string> keys = {WalkKey(context_, WalkOf(frame, 4)).dump()};
  for (const std::string_view path : {"zoom", "jump", "slow-worker", "turn-over"}) {
    Walk walk = WalkOf(frame, 4);
    walk.path = FindPath(path);
    EXPECT_TRUE(keys.insert(WalkKey(context_, walk).dump()).second) << path;
  }
  Walk transfer{frame, FindPath("transfer"), 4, TransferChoice{HalfShown(0.05)}};
  EXPECT_TRUE(keys.insert(WalkKey(context_, transfer).dump()).second);
  transfer.later = TransferChoice{HalfShown(0.1)};
  EXPECT_TRUE(keys.insert(WalkKey(context_, transfer).dump()).second);
  FrameCase drifting = frame;
  drifting.volume = ClusterCase({.size = 16}, 0.05);
  Walk series{drifting, FindPath("time-series"), kFramesOfAVolume, std::nullopt};
  const Json one_volume = WalkKey(context_, series);
  EXPECT_TRUE(keys.insert(one_volume.dump()).second);
  ++series.frames;
  EXPECT_NE(WalkKey(context_, series)["digest"], one_volume["digest"]);
}

TEST_F(Keys, ReadPlainly) {
  const Json key = BoxCostKey(context_, Example());
  EXPECT_EQ(key["what"], "box costs");
  EXPECT_EQ(key["dataset"], "class1-24-0.1");
  EXPECT_EQ(key["volume"], (Json{{"class", 1}, {"size", 24}, {"occupancy", 0.1}}));
  EXPECT_EQ(key["renderer"], "splat");
  EXPECT_EQ(key["view"]["roll_degrees"], 10);
  EXPECT_EQ(key["policy"], (Json{{"decomposition", "kd-tree"}, {"balance_by", "voxels"}, {"axis", "AXIS_CHOICE_AUTO"}, {"groups", 2}}));
}

// A trial that several cases share measures the boxes of each of them.
TEST_F(Keys, CasesThatShareATrialHaveTheSameBoxes) {
  FrameCase frame = Example();
  frame.volume = SphereCase({SphereClass::kHollow, 48, 0.1}, kTranslucentSphere);
  frame.workers = 5;
  for (const DecompositionEntry& decomposition : Decompositions()) {
    for (const std::string split : {"auto", "voxels", "occupied", "cost"}) {
      for (const AssignmentEntry& assignment : Assignments()) {
        if (assignment.by_owner) continue;  // nobody owns these voxels
        for (const std::string balance : {"static", "dynamic"}) {
          for (const int groups : {0, 1, 4}) {
            frame.policy = {.decomposition = std::string(decomposition.name),
                            .balance_by = split,
                            .groups = groups,
                            .assignment = std::string(assignment.name),
                            .balance = balance,
                            .combine = "radix-k",
                            .teams = 2};
            const FramePlan own = PlanOf(context_, frame), measured = PlanOf(context_, ForBoxCosts(context_, frame).frame);
            EXPECT_EQ(own.layout->partition, measured.layout->partition) << BoxCostKey(context_, frame).dump();
          }
        }
      }
    }
  }
}

TEST_F(Keys, TwoFilesOfOneNameAreTwoVolumes) {
  std::vector<BenchCase> cases;
  for (const auto& [directory, size] : {std::pair{"a", 8}, {"b", 10}}) {
    std::filesystem::create_directory(folder_ / directory);
    const std::string path = (folder_ / directory) + "/v.nrrd";
    ASSERT_TRUE(WriteVolume(MakeSphere({SphereClass::kFilled, size, 0.3}).value(), path).ok());
    cases.push_back(ParseBenchCase(path, false).value());
  }
  ASSERT_EQ(cases[0].name, cases[1].name);
  VolumeCache& volumes = context_.volumes();
  EXPECT_EQ(volumes.Get(cases[0]).volume->description.geometry.size.x, 8);
  EXPECT_EQ(volumes.Get(cases[1]).volume->description.geometry.size.x, 10);
  EXPECT_NE(volumes.Occupied(cases[0]), volumes.Occupied(cases[1]));
  FrameCase one = Example(), other = Example();
  one.volume = cases[0];
  other.volume = cases[1];
  EXPECT_NE(FinishKey(context_, one), FinishKey(context_, other));
  EXPECT_EQ(FinishKey(context_, one), FinishKey(context_, one));
}

TEST_F(Keys, TwoFilesOfOneNameHaveTheirOwnFigures) {
  std::vector<std::string> paths;
  for (const char* directory : {"a", "b", "c"}) {
    std::filesystem::create_directory(folder_ / directory);
    paths.push_back((folder_ / directory) + "/v.nrrd");
    ASSERT_TRUE(WriteVolume(MakeSphere({SphereClass::kFilled, 8, 0.3}).value(), paths.back()).ok());
  }
  std::vector<std::string> names;
  for (const BenchCase& volume : RealVolumes(paths)) names.push_back(volume.dataset);
  EXPECT_EQ(names, (std::vector<std::string>{"v", "v-2", "v-3"}));
}

TEST_F(Keys, AFileThatIsWrittenAnewIsAnotherVolume) {
  const std::string path = folder_ / "v.nrrd";
  const auto write = [&](double occupancy) {
    ASSERT_TRUE(WriteVolume(MakeSphere({SphereClass::kFilled, 8, occupancy}).value(), path).ok());
  };
  write(0.3);
  const BenchCase volume = ParseBenchCase(path, false).value();
  const Json before = VolumeCache().Identity(volume);
  EXPECT_EQ(VolumeCache().Identity(volume), before);
  write(0.1);
  EXPECT_NE(VolumeCache().Identity(volume), before);

  // Within a run it is an error: some trials would have the one, some the other.
  VolumeCache small(0);
  (void)small.Get(volume);
  write(0.3);
  (void)small.Get(SphereCase({}, kTranslucentSphere));
  EXPECT_THROW((void)small.Get(volume), Failure);
}

TEST_F(Keys, CasesThatDifferInTransferHaveTheirOwnOccupiedVoxels) {
  BenchCase all = SphereCase({SphereClass::kFilled, 8, 0.3}, 0.5), none = all;
  for (OpacityPoint& point : FunctionOf(none.transfer).opacities) point.opacity = 0;
  EXPECT_NE(context_.volumes().Occupied(all), context_.volumes().Occupied(none));
}

TEST_F(Keys, ViewsOfASweepThatDifferInRollAreTwoTrials) {
  const Sweep sweep = ParseSweep("s.json", R"({"volumes": [{"sphere": {"size": 24}}], "policies": [{}], "workers": [2],
    "views": [{"name": "upright", "roll": 0}, {"name": "tilted", "roll": 45}]})")
                          .value();
  std::vector<Trial> trials;
  for (const SweepView& view : sweep.views) {
    for (int twice = 0; twice < 2; ++twice) {
      trials.push_back(BoxCostTrial(context_, {sweep.volumes[0], sweep.size, view.view, sweep.policies[0].policy, sweep.workers[0]}));
    }
  }
  EXPECT_EQ(Distinct(std::move(trials)).size(), 2U);
}

}  // namespace
}  // namespace slabstream
