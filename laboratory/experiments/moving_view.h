// A turning view, frame after frame: the boxes are rendered alone and their times are learnt. Before the next frame the coordinator's own
// table of layouts may change the layout.
#pragma once

#include "laboratory/experiments/frame_case.h"

namespace slabstream {

inline constexpr int kMovingFrames = 24;  // in a turn

// Renders `frames` frames of a turn that begins with the frame's view. Numbers, by frame: "imbalance", "slowest_ms" (the render time of the
// slowest worker), "moved_bytes" (voxels that change their owner before the frame).
Trial MovingTrial(ExperimentContext& context, const FrameCase& first, int frames);
Json MovingKey(ExperimentContext& context, const FrameCase& first, int frames);

}  // namespace slabstream
