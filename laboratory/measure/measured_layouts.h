// MeasuredLayouts: layouts from frame to frame, made by the coordinator's LayoutTable from the render times of frames. The times decide the
// layouts, so the same times give the same layouts.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "coordinator/layout_table.h"

namespace slabstream {

class MeasuredLayouts {
 public:
  // Of `volume`, which has this summary; `occupied`: the voxels that it draws.
  MeasuredLayouts(std::shared_ptr<const VolumeSummary> summary, std::shared_ptr<const OccupancyGrid> occupied, ClassifiedVolume volume,
                  int workers)
      : summary_(std::move(summary)), occupied_(std::move(occupied)), volume_(std::move(volume)), slots_(std::uint32_t(workers)) {}

  // From the next frame on, the volume is shown under another transfer function, under which it draws `occupied`.
  void Show(std::shared_ptr<const OccupancyGrid> occupied, ClassifiedVolume volume) {
    occupied_ = std::move(occupied);
    volume_ = std::move(volume);
  }

  // The layout of the next frame, which may differ from the one before only in its view and what Show said. The request is valid.
  std::shared_ptr<const Layout> Next(const FrameRequest& request) {
    policy_ = ResolvePolicy(request, summary_->description.geometry).value();
    return table_.Find({&policy_, &volume_, summary_.get(), occupied_, slots_});
  }

  // Render times of the frame of the last Next, by PlacementsOf(plan).
  void Learn(const FramePlan& plan, std::span<const std::int64_t> nanoseconds) {
    std::vector<RankReport> reports;
    for (const Placement& placement : PlacementsOf(plan)) {
      RankReport& report = reports.emplace_back();
      report.box = placement.id;
      report.stage_ns[std::size_t(Stage::kRender)] = nanoseconds[reports.size() - 1];
    }
    table_.Learn(volume_, plan, policy_, reports);
  }

 private:
  std::shared_ptr<const VolumeSummary> summary_;
  std::shared_ptr<const OccupancyGrid> occupied_;
  ClassifiedVolume volume_;
  std::uint32_t slots_;
  ResolvedPolicy policy_;  // of the last Next
  LayoutTable table_;
};

}  // namespace slabstream
