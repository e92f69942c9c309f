// A frame with dynamic balance: the costs of its boxes after some frames of the same view, during which the coordinator's table of layouts
// learnt where the work is and changed the boxes. Each repeat is balanced separately, from its own measurements.
#pragma once

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr int kBalancedFrames = 12;  // to learn from, with each box measured once

// The trial that measures the frame's boxes: BoxCostTrial, or this one of a frame with dynamic balance.
Trial CostTrial(ExperimentContext& context, const FrameCase& frame);
// The key of the latter.
Json BalancedKey(ExperimentContext& context, const FrameCase& frame);

// One for each repeat, because layouts differ. The frame has dynamic balance; the trial, and FinishTrial, must have been run.
std::vector<MeasuredFrame> RecallBalanced(ExperimentContext& context, const FrameCase& frame);
// The same for a frame of any balance, by its CostTrial.
std::vector<MeasuredFrame> RecallCosts(ExperimentContext& context, const FrameCase& frame);

}  // namespace slabstream
