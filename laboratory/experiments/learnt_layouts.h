// LearntLayouts: the layouts of a case from frame to frame, as the coordinator's LayoutTable makes them of what frames took. What is learnt
// decides them, so that they come again when it is told again.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "coordinator/layout_table.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

class LearntLayouts {
 public:
  static Result<LearntLayouts> Make(ExperimentContext& context, const FrameCase& frame) {
    Result<LayoutKnowledge> knowledge = KnowLayout(context, frame);
    if (!knowledge.ok()) return knowledge.status();
    return LearntLayouts(*std::move(knowledge), std::uint32_t(frame.workers));
  }

  const LayoutKnowledge& knowledge() const { return knowledge_; }

  // Of the next frame, which may differ in its view alone from the one given to Make. Valid until the next call.
  const Layout& Next(const FrameCase& frame) {
    FrameRequest request = RequestOf(frame);
    request.policy = policy_ = SettledPolicy(request, knowledge_.volume.summary->description.geometry);
    return table_.Find({&request, kPlannedDataset, knowledge_.volume.summary.get(), &knowledge_.transfer, knowledge_.occupied, slots_,
                        CostModel().slab_bytes_target});
  }

  // What rendering the frame of the last Next took, by PlacementsOf(plan).
  void Learn(const FramePlan& plan, std::span<const std::int64_t> nanoseconds) {
    std::vector<RankReport> reports;
    for (const Placement& placement : PlacementsOf(plan)) {
      RankReport& report = reports.emplace_back();
      report.box = placement.id;
      report.stage_ns[std::size_t(Stage::kRender)] = nanoseconds[reports.size() - 1];
    }
    table_.Learn(plan, policy_, reports);
  }

 private:
  LearntLayouts(LayoutKnowledge knowledge, std::uint32_t slots) : knowledge_(std::move(knowledge)), slots_(slots) {}

  LayoutKnowledge knowledge_;
  Policy policy_;  // of the last Next
  std::uint32_t slots_;
  LayoutTable table_;
};

}  // namespace slabstream
