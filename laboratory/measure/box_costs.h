// Box costs: what each box of a partition costs to render, measured by rendering it in this process, alone, on one thread. From them the
// laboratory predicts frames for any number of workers, and partitions are judged by how even they are.
//
// A box is rendered as a worker does it: from its own voxels and halo, kept by bricks, by the same pipeline. The first rendering makes what
// workers keep between frames (classification, normals, occupied voxels); later ones are what a turning view costs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/image/coverage_map.h"
#include "common/image/local_image.h"
#include "common/planning/frame_plan.h"
#include "common/stats/report.h"

namespace slabstream {

struct BoxCost {
  Box box;
  double first_seconds = 0;           // processor time of the first rendering
  double seconds = 0;                 // of the median later one (of two the lower): the quickest is luck, for cores are at times quicker
  StageTimes stage_ns{};              // of that one, by the clock on the wall
  std::uint64_t occupied_voxels = 0;  // in the box, under the transfer function; splatting
  std::uint64_t drawn_voxels = 0;     // that went through splat or Z-buffer
  PixelBounds bounds;                 // of its local image
  std::uint64_t covered_pixels = 0;   // of them, not empty
  CoverageMap coverage;               // where these lie in the frame
  std::uint64_t voxel_bytes = 0;      // of box and halo: what its owner must fetch
};

// By the order of `boxes`, which lie inside the volume and are not empty. `setup` is of this volume (FramePlan::setup). `repeats` >= 1
// later rounds, in which each is rendered twice more. Nothing is hidden by other boxes. On the calling thread alone. All boxes are kept at
// once.
std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FrameSetup& setup, std::span<const Box> boxes, int repeats);

// The boxes that a plan has rendered, by the order of PlacementsOf(plan).
std::vector<BoxCost> MeasureBoxCosts(const Volume& volume, const FramePlan& plan, int repeats);

// Largest / mean of the boxes' `seconds`: 1 is perfect balance. With `slots` owners of several boxes each, sum their boxes first. 1 where
// nothing costs anything.
double Imbalance(std::span<const double> seconds);

}  // namespace slabstream
