#include "laboratory/experiments/view_sequence.h"

#include <cmath>

#include "common/planning/balance.h"
#include "common/planning/policy_names.h"
#include "laboratory/experiments/balanced_case.h"
#include "laboratory/experiments/frame_keys.h"
#include "laboratory/experiments/request_json.h"
#include "laboratory/measure/lab_worker.h"

namespace slabstream {
namespace {

constexpr int kRenderings = 1;  // of each box in each step; the repeats of the trial are many
constexpr std::uint32_t kSlowWorker = 1;

ViewParameters Turntable(double part) { return {.azimuth_degrees = 180 * part, .elevation_degrees = kBenchElevationDegrees}; }

bool LearnsTimes(const FrameCase& frame) { return IsDynamic(frame.policy) || BalanceByOf(frame.policy) == NameOf(BalanceBy::kCost); }

KeyedFrame ForSequence(ExperimentContext& context, const ViewSequence& sequence) {
  Json views = Json::array();
  for (int i = 0; i < sequence.steps; ++i) views.push_back(RequestJson(RequestOf(FrameOf(sequence, i))).at("view"));
  Json counts = {{"views", views}, {"slowed", sequence.slowed && LearnsTimes(sequence.frame)}, {"later", Json()}};
  if (sequence.later) counts["later"] = TransferJson(*sequence.later);
  return WithoutCombining(context, "view sequence", FrameOf(sequence, 0), std::move(counts));
}

// Walks through the layouts of a sequence: at each step `times` gets the plan and tells the render times of its boxes, in the order of
// PlacementsOf, on workers of one speed.
template <class Times>
void Walk(ExperimentContext& context, const ViewSequence& sequence, const Times& times) {
  MeasuredLayouts layouts(sequence.frame.workers);
  for (int i = 0; i < sequence.steps; ++i) {
    const FrameCase frame = FrameOf(sequence, i);
    const FramePlan plan = NextPlan(context, frame, layouts);
    std::vector<std::int64_t> nanoseconds;
    const std::vector<Placement> placements = PlacementsOf(plan);
    for (const double seconds : times(i, frame, plan)) {
      const bool slow = sequence.slowed && placements[nanoseconds.size()].worker == kSlowWorker;
      nanoseconds.push_back(std::int64_t(seconds * (slow ? kSlowdown : 1) * 1e9));
    }
    layouts.Learn(plan, nanoseconds);
  }
}

Json MeasureSequence(ExperimentContext& context, const ViewSequence& sequence) {
  const VolumeInUse volume = context.volumes().Get(sequence.frame.volume);
  LabWorker worker(*volume.volume);
  Json steps = Json::array();
  Walk(context, sequence, [&](int, const FrameCase&, const FramePlan& plan) {
    steps.push_back(NumbersOf(MeasureBoxCosts(worker, plan, kRenderings), plan));
    return steps.back().at("seconds").get<std::vector<double>>();
  });
  return Json{{"steps", std::move(steps)}};
}

// Each box's voxels that its worker does not hold from the step before.
void SetFetched(MeasuredFrame& frame, const Layout& before) {
  if (before == *frame.plan.layout) return;
  const auto voxel_bytes = double(BytesPerSample(frame.plan.setup.description.type));
  for (const Placement& placement : PlacementsOf(frame.plan)) {
    Layout alone = *frame.plan.layout;
    for (std::size_t box = 0; box < alone.owners.size(); ++box) {
      if (box != placement.id) alone.owners[box] = kNoSlot;
    }
    frame.boxes[placement.id].fetched_bytes = double(MovedVoxels(before, alone)) * voxel_bytes;
  }
}

}  // namespace

const std::vector<ViewMotion>& ViewMotions() {
  static const std::vector<ViewMotion> motions = {
      {"turntable", "half a turn about the z axis, orthographic", Turntable},
      {"zoom-in", "the picture is magnified from 1 to 4, orthographic",
       [](double part) {
         return ViewParameters{.azimuth_degrees = 30, .elevation_degrees = kBenchElevationDegrees, .zoom = std::pow(4, part)};
       }},
      {"turn-over", "half a turn about the x axis, over the top, orthographic",
       [](double part) { return ViewParameters{.elevation_degrees = 180 * part}; }},
      {"fly-through", "a quarter of a turn while approaching the volume, perspective",
       [](double part) {
         return ViewParameters{.projection = Projection::kPerspective,
                               .azimuth_degrees = 90 * part,
                               .elevation_degrees = kBenchElevationDegrees,
                               .zoom = std::pow(4, part),
                               .fov_degrees = 20 + 40 * part};
       }},
      {"perspective", "the turntable in perspective, 30 degrees of view",
       [](double part) {
         ViewParameters view = Turntable(part);
         view.projection = Projection::kPerspective;
         return view;
       }},
  };
  return motions;
}

FrameCase FrameOf(const ViewSequence& sequence, int step) {
  FrameCase frame = sequence.frame;
  frame.view = sequence.motion->at(double(step) / sequence.steps);
  if (sequence.later && step >= sequence.steps / 2) frame.volume.transfer = *sequence.later;
  return frame;
}

Json SequenceKey(ExperimentContext& context, const ViewSequence& sequence) { return ForSequence(context, sequence).key; }

Trial SequenceTrial(ExperimentContext& context, const ViewSequence& sequence) {
  const KeyedFrame keyed = ForSequence(context, sequence);
  ViewSequence measured = sequence;
  measured.frame = keyed.frame;
  measured.slowed = sequence.slowed && LearnsTimes(sequence.frame);
  return keyed.MakeTrial(
      context, [&context, measured] { return MeasureSequence(context, measured); },
      sequence.steps * BoxCostTrial(context, FrameOf(sequence, 0)).effort);
}

std::vector<SequenceFrames> RecallSequence(ExperimentContext& context, const ViewSequence& sequence) {
  std::vector<SequenceFrames> repeats;
  for (const Json* repeat : context.log().All(SequenceKey(context, sequence))) {
    SequenceFrames& frames = repeats.emplace_back();
    Walk(context, sequence, [&](int step, const FrameCase& frame, const FramePlan& plan) {
      const Json& numbers = repeat->at("steps").at(std::size_t(step));
      MeasuredFrame& measured = frames.emplace_back(WithBoxCosts(context, frame, plan, {&numbers}));
      if (step > 0) SetFetched(measured, *frames[std::size_t(step) - 1].plan.layout);
      for (const Placement& placement : PlacementsOf(measured.plan)) {
        if (sequence.slowed && placement.worker == kSlowWorker) measured.boxes[placement.id].seconds *= kSlowdown;
      }
      return numbers.at("seconds").get<std::vector<double>>();
    });
  }
  return repeats;
}

}  // namespace slabstream
