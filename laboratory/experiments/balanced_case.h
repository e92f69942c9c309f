// A frame with dynamic balance: the costs of its boxes after some frames of the same view, during which the coordinator's table of layouts
// learnt where the work is and changed the boxes. Each repeat is balanced separately, from its own measurements.
#pragma once

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr int kBalancedFrames = 6;  // to learn from, with each box measured once

// Assumes dynamic balance, whatever the policy says.
Trial BalancedTrial(ExperimentContext& context, const FrameCase& frame);

// One for each repeat, because layouts differ. The trial, and FinishTrial, must have been run.
Result<std::vector<MeasuredFrame>> RecallBalanced(ExperimentContext& context, const FrameCase& frame);

}  // namespace slabstream
