// Calibrate: the machine model of this host, measured in about two seconds.
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
  // The uncertainty of its numbers.
  HandOverEstimates hand_overs;
  Estimate memory_slowdown;
};

// For `workers` workers of the embedded service with one render thread each; they share the available cores and lend each other their
// images. Fails with the service.
Result<Calibration> CalibrateThisHost(int workers);

// The same without the measurements that take frames: hand-overs and slowdown keep their defaults.
MachineModel ThisHost(int workers);

// A slowdown clamped to the range of a machine model: [0, 0.99].
double ModelSlowdown(double measured);

}  // namespace slabstream
