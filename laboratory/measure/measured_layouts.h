// MeasuredLayouts: layouts from frame to frame, made by the coordinator's LayoutTable from the render times of frames. The times decide the
// layouts, so the same times give the same layouts.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "coordinator/layout_table.h"

namespace slabstream {

class MeasuredLayouts {
 public:
  explicit MeasuredLayouts(int workers) : slots_(std::uint32_t(workers)) {}

  // The layout of the next frame, whose request leaves no choice and draws the voxels `occupied`.
  std::shared_ptr<const Layout> Next(ResolvedRequest request, std::shared_ptr<const OccupancyGrid> occupied) {
    last_ = std::move(request);
    return table_.Find({&last_->policy.value(), &last_->volume, last_->summary.get(), std::move(occupied), slots_});
  }

  // Render times of the frame of the last Next, by PlacementsOf(plan).
  void Learn(const FramePlan& plan, std::span<const std::int64_t> nanoseconds) {
    std::vector<RankReport> reports;
    for (const Placement& placement : PlacementsOf(plan)) {
      RankReport& report = reports.emplace_back();
      report.box = placement.id;
      report.stage_ns[std::size_t(Stage::kRender)] = nanoseconds[reports.size() - 1];
    }
    table_.Learn(last_->volume, plan, *last_->policy, reports);
  }

 private:
  std::uint32_t slots_;
  std::optional<ResolvedRequest> last_;  // of Next
  LayoutTable table_;
};

}  // namespace slabstream
