#include "laboratory/experiments/walk.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "common/planning/balance.h"
#include "laboratory/bench/bench_cases.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/measure/lab_worker.h"

namespace slabstream {
namespace {

constexpr double kDegrees = 2;        // a step
constexpr double kStillDegrees = 30;  // azimuth of a view that does not move
constexpr double kJumpDegrees = 90;

ViewParameters Turned(double degrees) { return {.azimuth_degrees = degrees, .elevation_degrees = kBenchElevationDegrees}; }
ViewParameters Still(int, bool) { return Turned(kStillDegrees); }
// From 1 to 4 within a path.
double Magnified(int step) { return std::pow(4, double(step) / kPathFrames); }

constexpr std::uint32_t kSlowWorker = 1;

bool IsAfter(const Walk& walk, int step) { return step >= walk.frames / 2; }

KeyedFrame ForWalk(ExperimentContext& context, const Walk& walk) {
  Json frames = Json::array();
  for (int step = 0; step < walk.frames; ++step) {
    const FrameCase frame = FrameOf(walk, step);
    const Json request = RequestJson(RequestOf(frame));
    frames.push_back({request.at("view"), request.at("transfer"), context.volumes().Identity(frame.volume)});
  }
  Json counts = {{"path", walk.path->name}, {"frames", walk.frames}, {"digest", DigestText(frames.dump())}};
  return WithoutCombining(context, "walk", FrameOf(walk, 0), std::move(counts));
}

// A frame of a walk, planned.
struct WalkStep {
  int number = 0;
  FrameCase frame;
  FramePlan plan;
  std::vector<Placement> placements;
  std::vector<bool> changed;          // by placement: its worker did not draw this box of this volume with this look before
  std::vector<double> fetched_bytes;  // by placement: of voxels, with halo, that its worker does not hold
  bool new_volume = false;

  std::vector<double> OfWorkers(const std::vector<double>& by_placement) const {
    std::vector<double> sums(plan.slots);
    for (std::size_t i = 0; i < placements.size(); ++i) sums[placements[i].worker - 1] += by_placement[i];
    return sums;
  }
  double VoxelBytes(const Placement& placement) const {
    return double(PaddedBox(placement.box, plan.setup).voxel_count()) * double(BytesPerSample(plan.setup.description.type));
  }
};

// `before`: the layout of the step before; null: nobody holds anything.
std::vector<double> FetchedBytes(const WalkStep& step, const Layout* before) {
  std::vector<double> bytes(step.placements.size());
  if (before != nullptr && *before == *step.plan.layout) return bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Placement& placement = step.placements[i];
    if (before == nullptr) {
      bytes[i] = step.VoxelBytes(placement);
      continue;
    }
    Layout alone = *step.plan.layout;
    for (std::size_t box = 0; box < alone.owners.size(); ++box) {
      if (box != placement.id) alone.owners[box] = kNoSlot;
    }
    bytes[i] = double(MovedVoxels(*before, alone)) * double(BytesPerSample(step.plan.setup.description.type));
  }
  return bytes;
}

// What render times are multiplied by.
double SlownessOf(const Walk& walk, const WalkStep& step, const Placement& placement) {
  const bool slow = walk.path->change == PathChange::kSlowWorker && IsAfter(walk, step.number) && placement.worker == kSlowWorker;
  return slow ? kSlowdown : 1;
}

// Render times of the boxes of a step, by placement, on workers of one speed: of this frame, and lasting.
struct StepTimes {
  std::vector<double> first, lasting;
};

// Calls `visit` for each step. It tells the times.
template <class Visit>
void Follow(ExperimentContext& context, const Walk& walk, const Visit& visit) {
  MeasuredLayouts layouts(walk.frame.workers);
  std::shared_ptr<const Layout> before;
  std::set<std::pair<std::uint32_t, Box>> drawn;  // by worker, in the step before
  Json look_before, volume_before;
  for (int number = 0; number < walk.frames; ++number) {
    WalkStep step{.number = number, .frame = FrameOf(walk, number), .plan = {}, .placements = {}, .changed = {}, .fetched_bytes = {}};
    step.plan = NextPlan(context, step.frame, layouts);
    step.placements = PlacementsOf(step.plan);
    const Json look = TransferJson(step.frame.volume.transfer), volume = context.volumes().Identity(step.frame.volume);
    step.new_volume = volume != volume_before;
    if (step.new_volume) before = nullptr;
    step.fetched_bytes = FetchedBytes(step, before.get());
    const bool all = step.new_volume || look != look_before;
    std::set<std::pair<std::uint32_t, Box>> now;
    for (const Placement& placement : step.placements) {
      step.changed.push_back(all || !drawn.contains({placement.worker, placement.box}));
      now.emplace(placement.worker, placement.box);
    }
    const StepTimes times = visit(std::as_const(step));
    std::vector<std::int64_t> lasting, prepare;
    for (std::size_t i = 0; i < step.placements.size(); ++i) {
      const double per_second = SlownessOf(walk, step, step.placements[i]) * 1e9;
      lasting.push_back(std::int64_t(times.lasting[i] * per_second));
      prepare.push_back(std::int64_t(std::max(0.0, times.first[i] - times.lasting[i]) * per_second));
    }
    layouts.Learn(step.plan, lasting, prepare);
    drawn = std::move(now);
    before = step.plan.layout;
    look_before = look;
    volume_before = volume;
  }
}

Json MeasureWalk(ExperimentContext& context, const Walk& walk) {
  Json steps = Json::array();
  std::shared_ptr<const Volume> volume;  // outlives the worker
  std::unique_ptr<LabWorker> worker;
  Follow(context, walk, [&](const WalkStep& step) {
    if (step.new_volume) {
      worker.reset();
      volume = context.volumes().Get(step.frame.volume).volume;
      worker = std::make_unique<LabWorker>(*volume);
    }
    const std::vector<BoxCost> costs = MeasureNextFrame(*worker, step.plan, step.changed);
    StepTimes times{EachOf(costs, &BoxCost::first_seconds), EachOf(costs, &BoxCost::seconds)};
    Json numbers = {{"seconds", times.first}, {"lasting", times.lasting}};
    if (IsSampled(step.number)) numbers["boxes"] = NumbersOf(costs, step.plan);
    steps.push_back(std::move(numbers));
    return times;
  });
  return Json{{"steps", std::move(steps)}};
}

}  // namespace

const std::vector<Path>& Paths() {
  static const std::vector<Path> paths = {
      {"turntable", "a turn about the z axis, 2 degrees a step, orthographic", [](int step, bool) { return Turned(kDegrees * step); }},
      {"zoom", "the picture is magnified from 1 to 4, orthographic",
       [](int step, bool) {
         ViewParameters view = Still(step, false);
         view.zoom = Magnified(step);
         return view;
       }},
      {"jump", "a view that stays, but for a jump of 90 degrees in the middle",
       [](int, bool after) { return Turned(after ? kStillDegrees + kJumpDegrees : kStillDegrees); }, PathChange::kNothing, true},
      {"transfer", "one view; in the middle, the transfer function changes", Still, PathChange::kTransfer, true},
      {"slow-worker", "one view; from the middle on, one worker takes twice as long for each box", Still, PathChange::kSlowWorker, true},
      {"time-series", "one view; the volume changes every 15 frames (clusters alone, which drift)", Still, PathChange::kVolume},
      {"turn-over", "a turn about the x axis, 2 degrees a step, orthographic",
       [](int step, bool) { return ViewParameters{.elevation_degrees = kDegrees * step}; }},
      {"fly-through", "half a turn while approaching the volume, perspective",
       [](int step, bool) {
         ViewParameters view = Turned(step);
         view.projection = Projection::kPerspective;
         view.zoom = Magnified(step);
         view.fov_degrees = 20 + 40.0 * step / kPathFrames;
         return view;
       }},
  };
  return paths;
}

const Path* FindPath(std::string_view name) {
  const auto found = std::ranges::find(Paths(), name, &Path::name);
  return found == Paths().end() ? nullptr : &*found;
}

bool IsPossible(const Walk& walk) {
  switch (walk.path->change) {
    case PathChange::kTransfer: return walk.later.has_value();
    case PathChange::kVolume: return std::holds_alternative<ClusterRequest>(walk.frame.volume.volume);
    case PathChange::kNothing:
    case PathChange::kSlowWorker: break;
  }
  return true;
}

FrameCase FrameOf(const Walk& walk, int step) {
  FrameCase frame = walk.frame;
  frame.view = walk.path->at(step, IsAfter(walk, step));
  if (walk.path->change == PathChange::kTransfer && IsAfter(walk, step)) frame.volume.transfer = walk.later.value();
  if (walk.path->change == PathChange::kVolume) {
    const int number = step / kFramesOfAVolume, last = (kPathFrames - 1) / kFramesOfAVolume;
    std::get<ClusterRequest>(frame.volume.volume).time = double(number) / last;
  }
  return frame;
}

bool IsSampled(int step) { return step % kSampledFrames == kSampledFrames - 1; }

Json WalkKey(ExperimentContext& context, const Walk& walk) { return ForWalk(context, walk).key; }

Trial WalkTrial(ExperimentContext& context, const Walk& walk) {
  return ForWalk(context, walk)
      .MakeTrial(
          context, [&context, walk] { return MeasureWalk(context, walk); }, walk.frames * BoxCostTrial(context, FrameOf(walk, 0)).effort);
}

std::vector<std::vector<WalkFrame>> RecallWalk(ExperimentContext& context, const Walk& walk) {
  std::vector<std::vector<WalkFrame>> repeats;
  for (const Json* repeat : context.log().All(WalkKey(context, walk))) {
    std::vector<WalkFrame>& frames = repeats.emplace_back();
    Follow(context, walk, [&](const WalkStep& step) {
      const Json& numbers = repeat->at("steps").at(std::size_t(step.number));
      auto seconds = numbers.at("seconds").get<std::vector<double>>();
      std::vector<double> voxel_bytes;
      for (std::size_t i = 0; i < seconds.size(); ++i) {
        seconds[i] *= SlownessOf(walk, step, step.placements[i]);
        voxel_bytes.push_back(step.VoxelBytes(step.placements[i]));
      }
      WalkFrame& frame = frames.emplace_back();
      frame.worker_seconds = step.OfWorkers(seconds);
      frame.moved_bytes = step.OfWorkers(step.fetched_bytes);
      frame.most_voxel_bytes = std::ranges::max(step.OfWorkers(voxel_bytes));
      if (IsSampled(step.number)) {
        frame.whole = WithBoxCosts(context, step.frame, step.plan, {&numbers.at("boxes")});
        for (std::size_t i = 0; i < seconds.size(); ++i) {
          MeasuredFrame::Cost& box = frame.whole->boxes[step.placements[i].id];
          box.seconds = seconds[i];
          box.fetched_bytes = step.fetched_bytes[i];
        }
      }
      return StepTimes{numbers.at("seconds").get<std::vector<double>>(), numbers.at("lasting").get<std::vector<double>>()};
    });
  }
  return repeats;
}

}  // namespace slabstream
