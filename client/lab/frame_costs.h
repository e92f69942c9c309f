// Frame costs: everything that a simulation wants to know of one frame, measured in this process, on one thread: what each box of its plan
// takes and covers (box_costs.h), and what it takes to make the picture of them and to decode it.
#pragma once

#include <vector>

#include "client/lab/box_costs.h"
#include "common/planning/frame_plan.h"
#include "common/simulation/cost_fit.h"
#include "common/simulation/simulate_frames.h"

namespace slabstream {

struct PictureCost {
  double finish_seconds = 0;   // resampling or resolving, encoding, digest: what the display worker does
  double receive_seconds = 0;  // digest, check, decoding: what the client does
};

struct FrameCosts {
  std::vector<BoxCost> boxes;  // by BoxId of the plan; boxes without a placement cost nothing
  PictureCost picture;

  // As long as this and `plan`, which it was measured for, live. Voxels are taken to be cached.
  FrameInput Input(const FramePlan& plan) const;
};

// `repeats` >= 1: the boxes' fastest, the picture's median. `plan` is of this volume.
FrameCosts MeasureFrameCosts(const Volume& volume, const FramePlan& plan, int repeats);

// What the cost model is fitted to: processor time of each stage.
CostSample SampleOf(const BoxCost& box, const Camera& camera);

// Of the frame that the whole volume gives.
PictureCost MeasurePictureCost(const Volume& volume, const FrameSetup& setup, int repeats);

}  // namespace slabstream
