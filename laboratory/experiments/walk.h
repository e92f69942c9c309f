// Walks: one way to divide a volume, from frame to frame along a path. The boxes of each frame are rendered alone. With a balance that
// learns, their times are learnt, and before the next frame the coordinator's own table of layouts may change the layout.
#pragma once

#include <optional>
#include <vector>

#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/paths.h"

namespace slabstream {

struct Walk {
  FrameCase frame;  // its view, and the volume of a time series, are those of the first step
  const Path* path = nullptr;
  int frames = kPathFrames;
  std::optional<TransferChoice> later;  // the transfer function from the middle on (PathChange::kTransfer)
};

// Whether there is such a walk: a time series needs clusters, a change of the transfer function a later one.
bool IsPossible(const Walk& walk);

FrameCase FrameOf(const Walk& walk, int step);

// Measures the boxes of all frames.
Trial WalkTrial(ExperimentContext& context, const Walk& walk);
Json WalkKey(ExperimentContext& context, const Walk& walk);

// A frame of a repeat.
struct WalkFrame {
  std::vector<double> worker_seconds;  // render time of each worker; data that is made for a box that changed counts
  std::vector<double> moved_bytes;     // voxels that each worker must fetch, because boxes or the volume changed
  double most_voxel_bytes = 0;         // voxels, with halos, of the worker that holds most
  std::optional<MeasuredFrame> whole;  // frames that are sampled have it: to simulate
};
// Every kSampledFrames-th frame is sampled.
inline constexpr int kSampledFrames = 12;
bool IsSampled(int step);

// The walk of each repeat, frame by frame. WalkTrial, and FinishTrial of the frames that are sampled, must have been run.
std::vector<std::vector<WalkFrame>> RecallWalk(ExperimentContext& context, const Walk& walk);

}  // namespace slabstream
