// The ways in which boxes change from frame to frame. Each is one file and one line in Balances(). docs/adding.md says how to add one, and
// how to compare it with others first.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace slabstream {

struct Layout;
struct LayoutRequest;

// Seconds that a frame waits for each voxel that a change brings to a worker, learnt from earlier changes. Nothing: there were none.
struct MoveSeconds {
  std::optional<double> fetch = {};    // until they have come: the longest wait of any worker, over the voxels of all workers
  std::optional<double> prepare = {};  // until a worker has derived what its renderer needs, for each voxel of a new box
};

// What is known when a layout may change.
struct BalanceRequest {
  const Layout* now = nullptr;          // the layout of the last frames
  std::span<const double> seconds;      // measured render time of each box of `now`, newer frames count more; 0: not rendered
  const LayoutRequest* make = nullptr;  // what `now` was made for, with known.cost
  int frames_seen = 1;                  // frames of `now` since it was made, >= 1
  std::optional<double> noise = {};     // how much a box's time in a frame scatters (FrameNoise); none: not known yet
  MoveSeconds move = {};                // what moves took in the volume's earlier layouts
};

// A mean time of a box scatters no less than one over so many frames, since newer frames count more.
inline constexpr int kMostFramesAveraged = 9;

struct BalanceEntry {
  std::string_view name;     // what --balance takes
  std::string_view purpose;  // one line for --help
  // The layout to change to, if any. Pure: no picture may depend on it, and the same times give the same layout. Null: boxes never change.
  std::optional<Layout> (*change)(const BalanceRequest&) = nullptr;
  bool weighs = false;  // it weighs what a change costs, so it need not be asked after every frame
};

// The only list; the standard one first.
const std::vector<BalanceEntry>& Balances();
inline constexpr std::string_view kDynamicBalance = "dynamic";

}  // namespace slabstream
