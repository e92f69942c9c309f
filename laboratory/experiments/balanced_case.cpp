#include "laboratory/experiments/balanced_case.h"

#include "common/planning/policy_names.h"

namespace slabstream {
namespace {

Json BalancedKey(const FrameCase& frame) {
  Json key = BoxCostKey(frame);
  key["what"] = "balanced box costs";
  key["assignment"] = frame.policy.assignment;
  key["frames"] = kBalancedFrames;
  return key;
}

Json MeasureBalanced(ExperimentContext& context, const FrameCase& frame) {
  MeasuredLayouts layouts = LayoutsOf(KnowLayout(context, frame), frame.workers);
  Json learnt = Json::array();
  for (int i = 0; i < kBalancedFrames; ++i) {
    const FramePlan plan = PlanOf(context, frame, layouts.Next(RequestOf(frame)));
    std::vector<std::int64_t> nanoseconds;
    const Json boxes = MeasureBoxes(context, frame, plan);
    for (const Json& seconds : boxes.at("seconds")) nanoseconds.push_back(std::int64_t(seconds.get<double>() * 1e9));
    layouts.Learn(plan, nanoseconds);
    learnt.push_back(nanoseconds);
  }
  Json boxes = MeasureBoxes(context, frame, PlanOf(context, frame, layouts.Next(RequestOf(frame))));
  boxes["learnt"] = std::move(learnt);
  return boxes;
}

}  // namespace

bool IsDynamic(const FrameCase& frame) { return frame.policy.balance == kDynamicBalance; }

Trial CostTrial(ExperimentContext& context, const FrameCase& frame) {
  Trial boxes = BoxCostTrial(context, frame);
  if (!IsDynamic(frame)) return boxes;
  return {BalancedKey(frame), [&context, frame] { return MeasureBalanced(context, frame); }, (kBalancedFrames + 1) * boxes.effort};
}

std::vector<MeasuredFrame> RecallBalanced(ExperimentContext& context, const FrameCase& frame) {
  std::vector<MeasuredFrame> frames;
  for (const Json* repeat : context.log().All(BalancedKey(frame))) {
    MeasuredLayouts layouts = LayoutsOf(KnowLayout(context, frame), frame.workers);
    for (const Json& learnt : repeat->at("learnt")) {
      layouts.Learn(PlanOf(context, frame, layouts.Next(RequestOf(frame))), learnt.get<std::vector<std::int64_t>>());
    }
    frames.push_back(WithBoxCosts(context, frame, PlanOf(context, frame, layouts.Next(RequestOf(frame))), {repeat}));
  }
  return frames;
}

}  // namespace slabstream
