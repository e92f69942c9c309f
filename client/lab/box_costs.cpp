#include "client/lab/box_costs.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "client/lab/thread_time.h"
#include "common/base/check.h"
#include "worker/render/pipeline.h"

namespace slabstream {

std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FrameSetup& setup, std::span<const Box> boxes, int repeats) {
  CHECK_GE(repeats, 1);
  const std::unique_ptr<Renderer> renderer = MakeRenderer(setup.renderer);
  const std::atomic<bool> cancelled = false;
  tbb::task_arena one_thread(1);
  std::vector<BoxCost> costs;
  for (const Box& box : boxes) {
    BoxCost& cost = costs.emplace_back(BoxCost{.box = box, .seconds = std::numeric_limits<double>::infinity()});
    const Box slab_box = SlabBox(box, setup);
    cost.voxel_bytes = std::uint64_t(slab_box.voxel_count()) * BytesPerSample(volume.block.type);
    SlabData slab(BrickedVoxels(CutBlock(volume.block, slab_box)));
    for (int repeat = 0; repeat <= repeats; ++repeat) {
      RankReport report;
      one_thread.execute([&] {
        const double begin = ThreadSeconds();
        const LocalImage image = renderer->Render(slab, box, setup, {}, cancelled, report).value();
        const double seconds = ThreadSeconds() - begin;
        if (repeat == 0) {
          cost.first_seconds = seconds;
          cost.occupied_voxels = report.occupied_voxels;
          cost.drawn_voxels = report.drawn_voxels;
          cost.bounds = image.bounds;
          cost.coverage = FindCoverage(image, FrameBounds(setup).width(), FrameBounds(setup).height());
          cost.covered_pixels = std::uint64_t(std::llround(cost.coverage.pixels()));
        } else if (seconds < cost.seconds) {
          cost.seconds = seconds;
          cost.stage_ns = report.stage_ns;
        }
      });
    }
  }
  return costs;
}

std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FramePlan& plan, int repeats) {
  std::vector<Box> boxes;
  for (const Placement& placement : PlacementsOf(plan)) boxes.push_back(placement.box);
  return MeasureBoxCosts(volume, plan.setup, boxes, repeats);
}

double Imbalance(std::span<const double> seconds) {
  const double sum = std::accumulate(seconds.begin(), seconds.end(), 0.0);
  return sum > 0 ? *std::max_element(seconds.begin(), seconds.end()) * double(seconds.size()) / sum : 1;
}

}  // namespace slabstream
