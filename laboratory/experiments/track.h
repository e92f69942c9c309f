// Track: what the frames of a walk took, one repeat, whether they were rendered here or by a service; and the figures that are made of it.
#pragma once

#include <vector>

#include "laboratory/experiments/walk.h"
#include "laboratory/results/results.h"

namespace slabstream {

struct Track {
  // By frame, all as long: render time of the worker that renders longest and of all; bytes that all workers fetch.
  std::vector<double> longest_seconds, imbalance, render_seconds, moved_bytes;
  // By frame; some frames, or all.
  std::vector<double> latency_seconds, period_seconds;
  double moving_seconds = 0;    // over the frames but the first, in which the worker that receives most receives voxels; 0: not known
  double most_voxel_bytes = 0;  // the most that a worker holds at a time; 0: not known
};

// Adds the figures of the repeats: longest_render_time (mean, 95 % of frames, worst frame), imbalance, render_time, voxel_bytes,
// move_share, memory, settling_frames, latency and period. The first frame, for which all voxels travel, counts in `memory` alone.
// `simulated`: latency and period are.
void AddTracks(Results& results, const Walk& walk, const Json& of, const std::vector<Track>& repeats, bool simulated);

// The columns of results that describe a walk: its frames, policy and path.
Json ColumnsOf(const Walk& walk);

// A row a frame, with medians over the repeats.
void AddSteps(std::vector<Json>& rows, const Walk& walk, const std::vector<Track>& repeats);

}  // namespace slabstream
