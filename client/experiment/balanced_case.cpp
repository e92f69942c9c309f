#include "client/experiment/balanced_case.h"

#include "client/lab/box_costs.h"
#include "common/planning/policy_names.h"
#include "coordinator/layout_table.h"

namespace slabstream {
namespace {

FrameCase Balanced(FrameCase frame) {
  frame.policy.balance = kDynamicBalance;
  return frame;
}

Json BalancedKey(const FrameCase& frame) {
  Json key = BoxCostKey(frame);
  key["what"] = "balanced box costs";
  key["assignment"] = frame.policy.assignment;
  key["frames"] = kBalancedFrames;
  return key;
}

// Layouts from frame to frame. What is learnt decides them, so that they come again when it is told again.
class Layouts {
 public:
  static Result<Layouts> Make(ExperimentContext& context, const FrameCase& frame) {
    Result<LayoutKnowledge> knowledge = KnowLayout(context, frame);
    if (!knowledge.ok()) return knowledge.status();
    return Layouts(*std::move(knowledge), frame);
  }

  const Layout& Next() {
    FrameRequest request;
    request.renderer = renderer_;
    request.policy = policy_;
    return table_.Find({&request, kPlannedDataset, knowledge_.volume.summary.get(), &knowledge_.transfer, knowledge_.occupied, slots_,
                        CostModel().slab_bytes_target});
  }
  // `nanoseconds` by placement.
  void Learn(const FramePlan& plan, const std::vector<std::int64_t>& nanoseconds) {
    std::vector<RankReport> reports;
    for (const GroupPlan& group : plan.groups) {
      for (const Placement& placement : group.placements) {
        RankReport& report = reports.emplace_back();
        report.box = placement.id;
        report.stage_ns[std::size_t(Stage::kRender)] = nanoseconds.at(reports.size() - 1);
      }
    }
    table_.Learn(plan, policy_, reports);
  }

 private:
  Layouts(LayoutKnowledge knowledge, const FrameCase& frame)
      : knowledge_(std::move(knowledge)), renderer_(frame.volume.renderer), policy_(frame.policy), slots_(std::uint32_t(frame.workers)) {}

  LayoutKnowledge knowledge_;
  RendererKind renderer_;
  Policy policy_;
  std::uint32_t slots_;
  LayoutTable table_;
};

Result<Json> MeasureBalanced(ExperimentContext& context, const FrameCase& frame) {
  Result<Layouts> layouts = Layouts::Make(context, frame);
  if (!layouts.ok()) return layouts.status();
  Json learnt = Json::array();
  for (int i = 0; i < kBalancedFrames; ++i) {
    const Result<FramePlan> plan = PlanOf(context, frame, layouts->Next());
    if (!plan.ok()) return plan.status();
    const Result<Json> boxes = MeasureBoxes(context, frame, *plan);
    if (!boxes.ok()) return boxes.status();
    std::vector<std::int64_t> nanoseconds;
    for (const Json& seconds : boxes->at("seconds")) nanoseconds.push_back(std::int64_t(seconds.get<double>() * 1e9));
    layouts->Learn(*plan, nanoseconds);
    learnt.push_back(nanoseconds);
  }
  const Result<FramePlan> plan = PlanOf(context, frame, layouts->Next());
  if (!plan.ok()) return plan.status();
  Result<Json> boxes = MeasureBoxes(context, frame, *plan);
  if (boxes.ok()) (*boxes)["learnt"] = std::move(learnt);
  return boxes;
}

}  // namespace

Trial BalancedTrial(ExperimentContext& context, const FrameCase& frame) {
  const FrameCase balanced = Balanced(frame);
  return {BalancedKey(balanced), [&context, balanced] { return MeasureBalanced(context, balanced); },
          (kBalancedFrames + 1) * BoxCostTrial(context, balanced).effort};
}

Result<std::vector<MeasuredFrame>> RecallBalanced(ExperimentContext& context, const FrameCase& frame) {
  const FrameCase balanced = Balanced(frame);
  std::vector<MeasuredFrame> frames;
  for (const Json* repeat : context.log().All(BalancedKey(balanced))) {
    Result<Layouts> layouts = Layouts::Make(context, balanced);
    if (!layouts.ok()) return layouts.status();
    for (const Json& learnt : repeat->at("learnt")) {
      const Result<FramePlan> plan = PlanOf(context, balanced, layouts->Next());
      if (!plan.ok()) return plan.status();
      layouts->Learn(*plan, learnt.get<std::vector<std::int64_t>>());
    }
    Result<FramePlan> plan = PlanOf(context, balanced, layouts->Next());
    if (!plan.ok()) return plan.status();
    frames.push_back(WithBoxCosts(context, balanced, *std::move(plan), {repeat}));
  }
  return frames;
}

}  // namespace slabstream
