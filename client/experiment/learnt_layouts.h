// LearntLayouts: the layouts of a case from frame to frame, as the coordinator's LayoutTable makes them of what frames took. What is learnt
// decides them, so that they come again when it is told again.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "client/experiment/frame_case.h"
#include "coordinator/layout_table.h"

namespace slabstream {

class LearntLayouts {
 public:
  static Result<LearntLayouts> Make(ExperimentContext& context, const FrameCase& frame) {
    Result<LayoutKnowledge> knowledge = KnowLayout(context, frame);
    if (!knowledge.ok()) return knowledge.status();
    return LearntLayouts(*std::move(knowledge), frame);
  }

  const LayoutKnowledge& knowledge() const { return knowledge_; }

  // Of the next frame. Valid until the next call.
  const Layout& Next() {
    FrameRequest request;
    request.renderer = renderer_;
    request.policy = policy_;
    return table_.Find({&request, kPlannedDataset, knowledge_.volume.summary.get(), &knowledge_.transfer, knowledge_.occupied, slots_,
                        CostModel().slab_bytes_target});
  }

  // What rendering took, by PlacementsOf(plan).
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
  LearntLayouts(LayoutKnowledge knowledge, const FrameCase& frame)
      : knowledge_(std::move(knowledge)), renderer_(frame.volume.renderer), policy_(frame.policy), slots_(std::uint32_t(frame.workers)) {}

  LayoutKnowledge knowledge_;
  RendererKind renderer_;
  Policy policy_;
  std::uint32_t slots_;
  LayoutTable table_;
};

}  // namespace slabstream
