// Paths: how a view, a transfer function, a volume or a worker changes from frame to frame. Steps are small, as in pictures that a user
// turns: balance that follows measured times depends on how far views lie apart.
#pragma once

#include <string_view>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

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

}  // namespace slabstream
