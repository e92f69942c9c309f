// MeasuredLayouts: layouts from frame to frame, made by the coordinator's LayoutTable from the render times of frames. The times decide the
// layouts, so the same times give the same layouts.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "coordinator/planner/layout_table.h"

namespace slabstream {

class MeasuredLayouts {
 public:
  explicit MeasuredLayouts(int workers) : slots_(std::uint32_t(workers)) {}

  // The layout of the next frame, whose request draws the voxels `occupied`.
  std::shared_ptr<const Layout> Next(ResolvedRequest request, std::shared_ptr<const OccupancyGrid> occupied) {
    last_ = std::move(request);
    occupied_ = std::move(occupied);
    return table_.Find(Wanted());
  }

  // Render times of the frame of the last Next, by PlacementsOf(plan); `prepare`: of making what is kept of new boxes, beside them.
  void Learn(const FramePlan& plan, std::span<const std::int64_t> nanoseconds, std::span<const std::int64_t> prepare = {}) {
    std::vector<RankReport> reports;
    for (const Placement& placement : PlacementsOf(plan)) {
      RankReport& report = reports.emplace_back();
      report.box = placement.id;
      const std::size_t place = reports.size() - 1;
      const std::int64_t prepare_ns = prepare.empty() ? 0 : prepare[place];
      report.stage_ns[std::size_t(Stage::kPrepare)] = prepare_ns;
      report.stage_ns[std::size_t(Stage::kRender)] = nanoseconds[place] + prepare_ns;
    }
    table_.Learn(Wanted(), plan, reports);
  }

 private:
  LayoutTable::Request Wanted() const { return {&last_->policy, &last_->volume, last_->summary.get(), occupied_, slots_}; }

  std::uint32_t slots_;
  std::optional<ResolvedRequest> last_;  // the request of the last Next
  std::shared_ptr<const OccupancyGrid> occupied_;
  LayoutTable table_;
};

}  // namespace slabstream
