// Walks: one way to divide a volume, from frame to frame along a path. The boxes of each frame are rendered alone. With a balance that
// learns, their times are learnt, and before the next frame the coordinator's own table of layouts may change the layout.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/frame/frame_request.h"
#include "laboratory/experiments/frame_case.h"

namespace slabstream {

// Paths: how a view, a transfer function, a volume or a worker changes from frame to frame. Steps are small, as in pictures that a user
// turns: balance that follows measured times depends on how far views lie apart.
//
// What changes beside the view.
enum class PathChange {
  kNothing,
  kTransfer,    // in the middle, the transfer function
  kSlowWorker,  // from the middle on, worker 1 takes kSlowdown times as long for each box
  kVolume,      // every kFramesOfAVolume frames, the volume: a time series
};
inline constexpr double kSlowdown = 2;
inline constexpr int kFramesOfAVolume = 15;

struct Path {
  std::string_view name;
  std::string_view purpose;                         // one line for --help
  ViewParameters (*at)(int step, bool after) = {};  // the view of a step, from 0; after: it is in the second half
  PathChange change = PathChange::kNothing;
  bool settles = false;  // something happens in the middle, and nothing else: a method can settle
};

// The only list.
const std::vector<Path>& Paths();
const Path* FindPath(std::string_view name);  // null: there is none
inline constexpr int kPathFrames = 180;

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
