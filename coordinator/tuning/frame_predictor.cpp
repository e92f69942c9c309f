#include "coordinator/tuning/frame_predictor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/calibration/calibration.h"
#include "common/combining/schemes.h"
#include "common/image/coverage_map.h"
#include "common/planning/placement.h"
#include "simulator/simulate_frames.h"

namespace slabstream {
namespace {

double PicturePixels(const FrameSetup& setup) {
  return double(setup.camera.width) * setup.camera.height / (double(setup.camera.supersample) * setup.camera.supersample);
}

double FinishSeconds(const FrameSetup& setup) {
  double seconds = calibration::picture::kEncode * PicturePixels(setup);
  if (!setup.sheets.empty()) seconds += calibration::picture::kResample * PicturePixels(setup);
  if (setup.camera.supersample > 1) seconds += calibration::picture::kResolve * double(FrameBounds(setup).pixel_count());
  return seconds;
}

std::int32_t CoarsePixels(std::int32_t pixels, std::int32_t side) { return (pixels + side - 1) / side; }

std::int32_t ChoosePixelSide(const FrameSetup& setup, std::uint32_t slots) {
  const PixelBounds frame = FrameBounds(setup);
  const std::int64_t most = std::clamp<std::int64_t>(FramePredictor::kMostTiles / slots, 1, FramePredictor::kMostFrameTiles);
  std::int32_t side = 1;
  const auto tiles = [&] {
    return std::int64_t{CoverageTiles(CoarsePixels(frame.width(), side))} * CoverageTiles(CoarsePixels(frame.height(), side));
  };
  while (tiles() > most) ++side;
  return side;
}

// The simulation uses only the size of the frame and the eye.
FrameSetup Coarse(FrameSetup setup, std::int32_t side) {
  setup.front = {};
  if (!setup.sheets.empty()) {
    setup.sheets.width = CoarsePixels(setup.sheets.width, side);
    setup.sheets.height = CoarsePixels(setup.sheets.height, side);
  } else {
    setup.camera.width = CoarsePixels(setup.camera.width, side);
    setup.camera.height = CoarsePixels(setup.camera.height, side);
  }
  return setup;
}

MachineModel WithCoarsePixels(MachineModel machine, std::int32_t side) {
  CombiningCosts& costs = machine.combining;
  const double pixels = double(side) * side;
  for (double* seconds : {&costs.scan_pixel, &costs.encode_pixel, &costs.combine_pixel, &costs.local_pixel, &costs.hidden_pixel}) {
    *seconds *= pixels;
  }
  costs.rgba_bytes *= side * side;
  costs.depth_bytes *= side * side;
  costs.run_bytes *= side;  // a row of runs stands for so many
  return machine;
}

}  // namespace

FramePredictor::FramePredictor(const FrameSetup& setup, const VolumeSummary& summary, const OccupancyGrid& occupied,
                               const WorkField* measured, const MachineModel& machine, std::uint32_t slots, double render_scale)
    : slots_(slots),
      render_scale_(render_scale),
      pixel_side_(ChoosePixelSide(setup, slots)),
      coarse_(Coarse(setup, pixel_side_)),
      estimator_(setup, summary, occupied, measured, pixel_side_),
      finish_seconds_(FinishSeconds(setup)),
      receive_seconds_(calibration::picture::kReceive * PicturePixels(setup)),
      machine_(WithCoarsePixels(machine, pixel_side_)),
      roster_(RosterOf(slots)) {
  CHECK_GE(slots, 1U);
}

FramePredictor::Prepared FramePredictor::Prepare(Layout layout) const {
  Prepared prepared;
  FramePlan& plan = prepared.plan;
  plan.setup = coarse_;
  plan.layout = std::make_shared<const Layout>(std::move(layout));
  plan.slots = slots_;
  PlaceBoxes(plan);
  prepared.boxes.resize(plan.layout->owners.size());
  for (const Placement& placement : PlacementsOf(plan)) {
    BoxEstimator::Estimate& box = prepared.boxes[placement.id] = estimator_.Of(placement.box);
    box.seconds *= render_scale_;
  }
  return prepared;
}

bool FramePredictor::Affordable(const Prepared& prepared, const std::string& combine) const {
  // Steps grow with a power of the ranks; two small schedules give the exponent.
  constexpr Rank kFew = 32;
  const CombiningChoice scheme = ParseCombining(combine).value();
  const PixelRange frame = WholeFrame(prepared.plan.setup);
  double steps = 0;
  for (const GroupPlan& group : prepared.plan.groups) {
    const auto ranks = Rank(group.placements.size());
    if (ranks <= 2 * kFew) {
      steps += ranks > 0 ? double(scheme.Make({ranks, 0, frame}).steps.size()) : 0;
      continue;
    }
    const double few = double(scheme.Make({kFew, 0, frame}).steps.size()), twice = double(scheme.Make({2 * kFew, 0, frame}).steps.size());
    steps += twice * std::pow(double(ranks) / (2 * kFew), std::log2(twice / few));
  }
  return steps <= double(kMostSteps);
}

std::optional<FramePrediction> FramePredictor::Predict(Prepared& prepared, const std::string& combine) const {
  if (!Affordable(prepared, combine)) return std::nullopt;
  prepared.plan.combine = combine;
  CHECK(AssignWorkers(roster_, prepared.plan).ok());
  FrameInput input{.plan = &prepared.plan, .boxes = {}, .finish_seconds = finish_seconds_, .receive_seconds = receive_seconds_};
  for (const BoxEstimator::Estimate& box : prepared.boxes) {
    input.boxes.push_back({box.seconds, box.coverage.share.empty() ? nullptr : &box.coverage, 0});
  }
  const Timeline timeline = SimulateFrames(std::span(&input, 1), machine_, {.in_flight = 1, .keep_spans = false}).value();
  const SimulatedFrame& frame = timeline.frames.front();
  const auto stage = [&frame](Stage s) { return frame.stage_seconds[std::size_t(s)]; };
  return FramePrediction{.render_seconds = frame.imbalance * stage(Stage::kRender) / slots_,
                         .combine_seconds = stage(Stage::kCombine) + stage(Stage::kEncode),
                         .finish_seconds = finish_seconds_ / std::max(machine_.threads, machine_.picture_threads),
                         .latency_seconds = frame.latency(),
                         .imbalance = frame.imbalance};
}

}  // namespace slabstream
