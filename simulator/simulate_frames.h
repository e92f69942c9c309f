// SimulateFrames: frame plans in virtual time, on any machine. Pure and deterministic.
//
// The coordinator's FrameMachine and a WorkerMachine for each worker decide everything, as in the service: the window, who renders what
// when, which step of a schedule is taken, in which order groups are accumulated. What they start takes the time given by the machine model
// and the costs of boxes. A worker has three lanes: one renders, one combines and encodes, one makes pictures; each does one task after the
// other. Simplifications: nothing is lost; a box costs what it took by itself, whatever groups in front hide; one client asks for the
// frames; previews travel for free.
//
// An image of several ranks fills this share of a range: in each tile of 16 x 16 pixels the ranks' shares count as independent, 1 - prod(1
// - share). The truth lies between their maximum and their sum; in full or empty tiles all three agree. A message has one run for each row
// and each unbroken stretch of tiles that are not empty.
#pragma once

#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/image/coverage_map.h"
#include "common/planning/frame_plan.h"
#include "simulator/model/machine_model.h"
#include "simulator/model/timeline.h"

namespace slabstream {

// The cost and the image of one box, in one view.
struct RenderCost {
  double seconds = 0;                     // of one thread of a worker
  const CoverageMap* coverage = nullptr;  // what its image covers, in the frame's grid; null: it shows nothing
  double voxel_bytes = 0;                 // bytes that its worker must fetch before it renders; 0: it holds them
};

struct FrameInput {
  const FramePlan* plan = nullptr;  // outlives the call. Every placement's worker is in [1, 2^31)
  std::vector<RenderCost> boxes;    // by BoxId; at least those of all placements
  double finish_seconds = 0;        // the picture from the accumulated frame, encoded
  double receive_seconds = 0;       // the client checks and decodes it
  double picture_bytes = 0;         // encoded
};

struct SimulationOptions {
  int in_flight = 1;       // frames that the client asks for ahead, [1, kMaxOpenRequests]
  bool keep_spans = true;  // Timeline::spans and messages
};

// InvalidArgument: a machine, plan or cost that is out of range or does not fit, with its place. Workers are numbered by WorkerId, in
// ascending order over all plans.
Result<Timeline> SimulateFrames(std::span<const FrameInput> frames, const MachineModel& machine, const SimulationOptions& options = {});

}  // namespace slabstream
