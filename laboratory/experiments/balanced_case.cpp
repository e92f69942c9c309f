#include "laboratory/experiments/balanced_case.h"

#include "common/planning/resolved_policy.h"
#include "laboratory/experiments/frame_keys.h"

namespace slabstream {
namespace {

KeyedFrame ForBalanced(ExperimentContext& context, const FrameCase& frame) {
  return WithoutCombining(context, "balanced box costs", frame, {{"frames", kBalancedFrames}});
}

Json MeasureBalanced(ExperimentContext& context, const FrameCase& frame) {
  MeasuredLayouts layouts(frame.workers);
  Json learnt = Json::array();
  for (int i = 0; i < kBalancedFrames; ++i) {
    const FramePlan plan = NextPlan(context, frame, layouts);
    std::vector<std::int64_t> nanoseconds;
    const Json boxes = MeasureBoxes(context, frame, plan);
    for (const Json& seconds : boxes.at("seconds")) nanoseconds.push_back(std::int64_t(seconds.get<double>() * 1e9));
    layouts.Learn(plan, nanoseconds);
    learnt.push_back(nanoseconds);
  }
  Json boxes = MeasureBoxes(context, frame, NextPlan(context, frame, layouts));
  boxes["learnt"] = std::move(learnt);
  return boxes;
}

}  // namespace

Json BalancedKey(ExperimentContext& context, const FrameCase& frame) { return ForBalanced(context, frame).key; }

Trial CostTrial(ExperimentContext& context, const FrameCase& frame) {
  Trial boxes = BoxCostTrial(context, frame);
  if (!IsDynamic(frame.policy)) return boxes;
  const KeyedFrame keyed = ForBalanced(context, frame);
  const auto run = [&context, frame = keyed.frame] { return MeasureBalanced(context, frame); };
  return keyed.MakeTrial(context, run, (kBalancedFrames + 1) * boxes.effort);
}

std::vector<MeasuredFrame> RecallBalanced(ExperimentContext& context, const FrameCase& frame) {
  std::vector<MeasuredFrame> frames;
  for (const Json* repeat : context.log().All(BalancedKey(context, frame))) {
    MeasuredLayouts layouts(frame.workers);
    for (const Json& learnt : repeat->at("learnt")) {
      layouts.Learn(NextPlan(context, frame, layouts), learnt.get<std::vector<std::int64_t>>());
    }
    frames.push_back(WithBoxCosts(context, frame, NextPlan(context, frame, layouts), {repeat}));
  }
  return frames;
}

std::vector<MeasuredFrame> RecallCosts(ExperimentContext& context, const FrameCase& frame) {
  return IsDynamic(frame.policy) ? RecallBalanced(context, frame) : RecallRepeats(context, frame);
}

}  // namespace slabstream
