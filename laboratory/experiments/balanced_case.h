// A frame with dynamic balance: what its boxes cost after some frames of the same view, in which the coordinator's table of layouts learnt
// where the work is and changed the boxes. Every repeat is balanced by itself, from what it measured itself.
#pragma once

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr int kBalancedFrames = 6;  // that are learnt from, at one box measured once each

// The policy's balance is taken to be dynamic, whatever it says.
Trial BalancedTrial(ExperimentContext& context, const FrameCase& frame);

// By repeat: layouts differ. The trial, and FinishTrial, must have been run.
Result<std::vector<MeasuredFrame>> RecallBalanced(ExperimentContext& context, const FrameCase& frame);

}  // namespace slabstream
