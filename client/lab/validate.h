// Validation: frames of the embedded service beside what the simulation says of them, in one run.
//
// For each view of a turning volume and each number of workers: the plan is made as the coordinator makes it, its boxes are rendered one by
// one in this process, alone on one thread, and their costs simulated on a model of this machine (calibrate.h); the service renders the
// same view with so many workers of one thread each, one frame in flight. Nothing of the service's own times enters the simulation.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/planning/frame_request.h"
#include "common/volume/volume.h"

namespace slabstream {

struct ValidationCase {
  std::string name;
  std::shared_ptr<const Volume> volume;
  FrameRequest request;  // azimuth and dataset are filled in
  int workers = 1;
};

struct ValidationOptions {
  int views = 6;    // azimuths, evenly over a turn
  int turns = 5;    // frames of each view by the service
  int repeats = 3;  // renderings of each box
};

// Of one frame, in seconds.
struct FrameParts {
  double render = 0;   // of the worker that rendered longest
  double picture = 0;  // made of the frame and encoded, by the display worker
  double latency = 0;  // request to decoded picture, all in all
};

struct ValidationRow {
  std::string name;
  int workers = 1;
  std::vector<FrameParts> measured, simulated;  // by view; measured: medians over turns
  double memory_slowdown = 0;                   // of this volume (MachineModel)

  FrameParts MeanMeasured() const;
  FrameParts MeanSimulated() const;
  double error() const { return MeanSimulated().latency / MeanMeasured().latency - 1; }  // of the latency
  double worst_error() const;                                                            // of one view, the largest in size
};

Result<ValidationRow> ValidateSimulation(const ValidationCase& what, const ValidationOptions& options);

}  // namespace slabstream
