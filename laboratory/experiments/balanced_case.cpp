#include "laboratory/experiments/balanced_case.h"

#include "common/planning/policy_names.h"
#include "laboratory/measure/box_costs.h"

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

Result<Json> MeasureBalanced(ExperimentContext& context, const FrameCase& frame) {
  const Result<LayoutKnowledge> knowledge = KnowLayout(context, frame);
  if (!knowledge.ok()) return knowledge.status();
  MeasuredLayouts layouts = LayoutsOf(*knowledge, frame.workers);
  Json learnt = Json::array();
  for (int i = 0; i < kBalancedFrames; ++i) {
    const Result<FramePlan> plan = PlanOf(context, frame, layouts.Next(RequestOf(frame)));
    if (!plan.ok()) return plan.status();
    const Result<Json> boxes = MeasureBoxes(context, frame, *plan);
    if (!boxes.ok()) return boxes.status();
    std::vector<std::int64_t> nanoseconds;
    for (const Json& seconds : boxes->at("seconds")) nanoseconds.push_back(std::int64_t(seconds.get<double>() * 1e9));
    layouts.Learn(*plan, nanoseconds);
    learnt.push_back(nanoseconds);
  }
  const Result<FramePlan> plan = PlanOf(context, frame, layouts.Next(RequestOf(frame)));
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
    const Result<LayoutKnowledge> knowledge = KnowLayout(context, balanced);
    if (!knowledge.ok()) return knowledge.status();
    MeasuredLayouts layouts = LayoutsOf(*knowledge, balanced.workers);
    for (const Json& learnt : repeat->at("learnt")) {
      const Result<FramePlan> plan = PlanOf(context, balanced, layouts.Next(RequestOf(balanced)));
      if (!plan.ok()) return plan.status();
      layouts.Learn(*plan, learnt.get<std::vector<std::int64_t>>());
    }
    Result<FramePlan> plan = PlanOf(context, balanced, layouts.Next(RequestOf(balanced)));
    if (!plan.ok()) return plan.status();
    frames.push_back(WithBoxCosts(context, balanced, *std::move(plan), {repeat}));
  }
  return frames;
}

}  // namespace slabstream
