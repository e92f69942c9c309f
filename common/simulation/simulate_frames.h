// SimulateFrames: frame plans in virtual time, on any machine, by the rules of the service. Pure and deterministic.
//
// What is followed (docs/architecture.md): as many unfinished groups and frames as the window allows (common/planning/frame_window.h); a
// worker renders one rank at a time, in order of frame, group and rank, on its render lane; its combine lane does one task after the other
// in the order in which they came up, its finish lane likewise makes pictures; a step of the schedule is taken at a rank when that is
// rendered, nothing is being combined for it, and all its earlier steps on the same pixels are taken; the display worker accumulates groups
// in order, reports each one done, and makes the picture. What is left out: nothing is lost, nothing is hidden by groups in front (box
// costs are those of boxes alone), frames are asked for by one client, previews travel for free.
//
// How many pixels of a range an image of several ranks fills: of each tile of 16 x 16 pixels the ranks' shares count as if they were
// independent, 1 - prod(1 - share). The truth lies between their maximum and their sum; where tiles are full or empty all three agree. Runs
// in a message: one for each row and each unbroken stretch of tiles that are not empty.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/image/coverage_map.h"
#include "common/planning/frame_plan.h"
#include "common/simulation/machine_model.h"
#include "common/simulation/timeline.h"

namespace slabstream {

// What one box costs and gives, under one view.
struct RenderCost {
  double seconds = 0;                     // of one thread of a worker of speed 1
  const CoverageMap* coverage = nullptr;  // of its image, in the frame's grid; null: it shows nothing
  double voxel_bytes = 0;                 // that its worker must fetch before it renders; 0: it holds them
};

struct FrameInput {
  const FramePlan* plan = nullptr;  // outlives the call. Every placement's worker is in [1, 2^31)
  std::vector<RenderCost> boxes;    // by BoxId; at least those of all placements
  double finish_seconds = 0;        // the picture from the accumulated frame, encoded
  double receive_seconds = 0;       // the client checks and decodes it
};

struct SimulationOptions {
  int in_flight = 1;       // frames that the client asks for ahead, >= 1
  bool keep_spans = true;  // Timeline::spans and messages
  // Any worker renders any box that waits, of the oldest group the costliest one first, and neither its voxels nor its image take any time
  // between the box's owner and the worker: the most that work stealing could win.
  bool steal = false;
};

// InvalidArgument: a machine, plan or cost that is out of range or does not fit, with its place. Workers are numbered by WorkerId, in
// ascending order over all plans.
Result<Timeline> SimulateFrames(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options = {});

}  // namespace slabstream
