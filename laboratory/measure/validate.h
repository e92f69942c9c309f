// Validation: compares frames of the embedded service with their simulation, in one run.
//
// Turn after turn and view after view, in sequence:
//   - the service renders the view with one or two workers of one thread each, one frame in flight;
//   - in this process, the boxes of its plan are rendered alone, on one thread; with two workers also both at once, which shows how much
//     they slow each other down (plan_renderings.h); the picture is made and decoded.
// Each of these is done twice in a row, and the second time counts: its threads have not slept for long, and its data is in the caches if
// it fits. Before each turn, frames of another volume and service measure wake-ups. The measurements of a view in a turn are simulated on
// a model of this machine (calibrate.h). So both sides meet the same state of the machine, and both are medians over turns. No time
// of the measured service enters the simulation.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/frame/frame_request.h"
#include "common/volume/volume.h"
#include "laboratory/measure/wake_up_probe.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

struct ValidationCase {
  std::string name;
  std::shared_ptr<const Volume> volume;
  FrameRequest request;  // the request of the first view; the dataset is filled in
  int workers = 1;       // or 2
};

struct ValidationOptions {
  int views = 4;   // evenly over a turn of the volume, from the azimuth of the request on
  int turns = 15;  // frames of each view
};

// The parts of one frame, in seconds.
struct FrameParts {
  double render = 0;   // the longest render time of a worker
  double picture = 0;  // made from the frame and encoded, by the display worker
  double latency = 0;  // from request to decoded picture
};

struct ValidatedView {
  ViewParameters view;
  FrameParts measured, simulated;              // medians over turns, each part separately
  double measured_low = 0, measured_high = 0;  // quartiles of the latency: the noise of the machine
  double simulated_low = 0, simulated_high = 0;
  double error() const { return simulated.latency / measured.latency - 1; }
};

struct ValidationRow {
  std::string name;
  int workers = 1;
  std::vector<ValidatedView> views;
  MachineModel machine;  // at the end
  WakeUpEstimates wake_ups;
  Estimate slowdown;  // the slowdown of two workers' renderings, over all turns and views

  ValidatedView Mean() const;  // over views, each number separately
  double error() const { return Mean().error(); }
};

// InvalidArgument: workers beyond 2. Fails with the service.
Result<ValidationRow> ValidateSimulation(const ValidationCase& what, const ValidationOptions& options);

}  // namespace slabstream
