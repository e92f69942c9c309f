// Calibrate: the machine model of this host, measured in two seconds or so.
//
//   combining     the operators that a worker's combining thread runs (combining_costs.h)
//   hand-overs    frames of the embedded service with tiny pictures (hand_over_probe.h)
//   neighbours    two halves of a sphere rendered alone and at once (neighbours.h)
#pragma once

#include "common/base/status.h"
#include "common/simulation/machine_model.h"
#include "laboratory/measure/hand_over_fit.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

struct Calibration {
  MachineModel machine;
  // How sure its numbers are.
  HandOverEstimates hand_overs;
  Estimate memory_slowdown;
};

// Workers are those of the embedded service, `workers` of them, one render thread each; they share the cores that there are and lend each
// other their images. Fails with the service.
Result<Calibration> CalibrateThisHost(int workers);

// The same without what takes frames to measure: hand-overs and slowdown are left as they are by default.
MachineModel ThisHost(int workers);

// A slowdown as a machine model can have it: [0, 0.99].
double ModelSlowdown(double measured);

}  // namespace slabstream
