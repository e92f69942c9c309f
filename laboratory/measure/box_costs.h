// Box costs: the render time of each box of a partition, measured by rendering it in this process, alone, on one thread. From them the
// laboratory predicts frames for any number of workers and judges how even partitions are.
//
// A box is rendered as in a worker: from its own voxels and halo, kept by bricks, by the same pipeline. The first rendering makes the data
// that workers keep between frames (classification, normals, occupied voxels); later ones give the cost of a turning view.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/image/coverage_map.h"
#include "common/planning/frame_plan.h"
#include "common/stats/report.h"

namespace slabstream {

class LabWorker;

struct BoxCost {
  Box box;
  double first_seconds = 0;           // processor time of the first rendering
  double seconds = 0;                 // median of the later ones; the minimum is luck, since cores are at times quicker
  StageTimes stage_ns{};              // median of each, in elapsed time
  std::uint64_t occupied_voxels = 0;  // in the box, under the transfer function; splatting
  std::uint64_t drawn_voxels = 0;     // voxels that went through splat or Z-buffer
  PixelBounds bounds;                 // pixels of its local image
  std::uint64_t covered_pixels = 0;   // non-empty pixels in the bounds
  CoverageMap coverage;               // where these pixels lie in the frame
  std::uint64_t voxel_bytes = 0;      // voxels of box and halo: the owner must fetch them
};

// In the order of `boxes`, which lie inside the volume and are not empty. `setup` is of this volume (FramePlan::setup). `repeats` >= 1
// later rounds, each of which renders every box twice more. Other boxes hide nothing. Runs on the calling thread alone. Keeps all boxes at
// once.
std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FrameSetup& setup, std::span<const Box> boxes, int repeats);

// The boxes that a plan renders, in the order of PlacementsOf(plan).
std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FramePlan& plan, int repeats);

// For walks of many frames, by a worker that keeps what it made for boxes of earlier frames. Each box is rendered once, and one that
// `changed` (by placement) twice: what is held of it is dropped before, so that first_seconds has the data made for it, and seconds does
// not. If a box did not change, both are the same. Drops what the worker holds of boxes that the plan does not render.
std::vector<BoxCost> MeasureNextFrame(LabWorker& worker, const FramePlan& plan, const std::vector<bool>& changed);

// Largest / mean of the boxes' `seconds`: 1 is perfect balance, and the value if all costs are 0. With `slots` owners of several boxes
// each, sum their boxes first.
double Imbalance(std::span<const double> seconds);

}  // namespace slabstream
