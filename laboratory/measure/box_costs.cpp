#include "laboratory/measure/box_costs.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "common/base/check.h"
#include "laboratory/measure/lab_worker.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

namespace {

// All but `seconds` and `stage_ns`, which tell of later renderings.
BoxCost CostOfFirst(const Box& box, const FrameSetup& setup, const BoxRendering& first) {
  BoxCost cost{.box = box, .first_seconds = first.processor_seconds};
  cost.occupied_voxels = first.report.occupied_voxels;
  cost.drawn_voxels = first.report.drawn_voxels;
  cost.bounds = first.image.bounds;
  cost.coverage = FindCoverage(first.image, FrameBounds(setup).width(), FrameBounds(setup).height());
  cost.covered_pixels = std::uint64_t(std::llround(cost.coverage.pixels()));
  cost.voxel_bytes = std::uint64_t(PaddedBox(box, setup).voxel_count()) * BytesPerSample(setup.description.type);
  return cost;
}

}  // namespace

std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FrameSetup& setup, std::span<const Box> boxes, int repeats) {
  CHECK_GE(repeats, 1);
  LabWorker worker(volume);
  std::vector<BoxCost> costs;
  for (const Box& box : boxes) costs.push_back(CostOfFirst(box, setup, worker.Render(box, setup)));
  // In rounds: a moment in which the machine is slower or quicker affects only part of a box's times. Each round renders a box twice, and
  // the second time counts: a worker's caches hold what it rendered last, not other workers' boxes.
  std::vector<std::vector<BoxRendering>> again(boxes.size());
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      (void)worker.Render(boxes[i], setup);
      again[i].push_back(worker.Render(boxes[i], setup));
      again[i].back().image = {};
    }
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const auto median = [&](auto&& number) { return MedianOf(EachOf(again[i], number)).median; };
    costs[i].seconds = median(&BoxRendering::processor_seconds);
    for (std::size_t stage = 0; stage < costs[i].stage_ns.size(); ++stage) {
      using Nanoseconds = std::remove_reference_t<decltype(costs[i].stage_ns[stage])>;
      costs[i].stage_ns[stage] = Nanoseconds(median([stage](const BoxRendering& r) { return r.report.stage_ns[stage]; }));
    }
  }
  return costs;
}

std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FramePlan& plan, int repeats) {
  std::vector<Box> boxes;
  for (const Placement& placement : PlacementsOf(plan)) boxes.push_back(placement.box);
  return MeasureBoxCosts(volume, plan.setup, boxes, repeats);
}

std::vector<BoxCost> MeasureNextFrame(LabWorker& worker, const FramePlan& plan, const std::vector<bool>& changed) {
  const std::vector<Placement> placements = PlacementsOf(plan);
  CHECK_EQ(changed.size(), placements.size());
  std::vector<Box> kept;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    if (!changed[i]) kept.push_back(placements[i].box);
  }
  worker.KeepOnly(kept, plan.setup);
  std::vector<BoxCost> costs;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const Box& box = placements[i].box;
    BoxRendering rendering = worker.Render(box, plan.setup);
    BoxCost& cost = costs.emplace_back(CostOfFirst(box, plan.setup, rendering));
    if (changed[i]) rendering = worker.Render(box, plan.setup);
    cost.seconds = rendering.processor_seconds;
    cost.stage_ns = rendering.report.stage_ns;
  }
  return costs;
}

double Imbalance(std::span<const double> seconds) {
  const double sum = std::accumulate(seconds.begin(), seconds.end(), 0.0);
  return sum > 0 ? *std::max_element(seconds.begin(), seconds.end()) * double(seconds.size()) / sum : 1;
}

}  // namespace slabstream
