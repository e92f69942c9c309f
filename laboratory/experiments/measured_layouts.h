// MeasuredLayouts: the layouts of a case from frame to frame, made by the coordinator's LayoutTable from the render times of frames. The
// times decide the layouts, so the same times give the same layouts.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "coordinator/layout_table.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

class MeasuredLayouts {
 public:
  static Result<MeasuredLayouts> Make(ExperimentContext& context, const FrameCase& frame) {
    Result<LayoutKnowledge> knowledge = KnowLayout(context, frame);
    if (!knowledge.ok()) return knowledge.status();
    return MeasuredLayouts(*std::move(knowledge), std::uint32_t(frame.workers));
  }

  const LayoutKnowledge& knowledge() const { return knowledge_; }

  // The layout of the next frame, which may differ only in its view from the one given to Make. Valid until the next call.
  const Layout& Next(const FrameCase& frame) {
    policy_ = ResolvePolicy(RequestOf(frame), knowledge_.volume.summary->description.geometry).value();
    layout_ = table_.Find({&policy_, &volume_, knowledge_.volume.summary.get(), knowledge_.occupied, slots_});
    return *layout_;
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
  MeasuredLayouts(LayoutKnowledge knowledge, std::uint32_t slots)
      : knowledge_(std::move(knowledge)), volume_(kPlannedDataset, knowledge_.transfer, knowledge_.renderer), slots_(slots) {}

  LayoutKnowledge knowledge_;
  ClassifiedVolume volume_;
  ResolvedPolicy policy_;  // of the last Next
  std::shared_ptr<const Layout> layout_;
  std::uint32_t slots_;
  LayoutTable table_;
};

}  // namespace slabstream
