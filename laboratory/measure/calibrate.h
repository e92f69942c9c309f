// Calibrate: the machine model of this host, measured in about two seconds.
//
//   combining     the operators that a worker's combining thread runs (combining_costs.h)
//   wake-ups    frames of the embedded service with tiny pictures (wake_up_probe.h)
//   neighbours    two halves of a sphere rendered alone and at once (neighbours.h)
#pragma once

#include "common/base/status.h"
#include "laboratory/measure/statistics.h"
#include "laboratory/measure/wake_up_fit.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

struct Calibration {
  MachineModel machine;
  // The uncertainty of its numbers.
  WakeUpEstimates wake_ups;
  Estimate memory_slowdown;
};

// For `workers` workers of the embedded service with one render thread each; they share the available cores and lend each other their
// images. Fails with the service.
Result<Calibration> CalibrateThisHost(int workers);

// The same without the measurements that take frames: wake-ups and slowdown keep their defaults.
MachineModel ThisHost(int workers);

// A slowdown clamped to the range of a machine model: [0, 0.99].
double ModelSlowdown(double measured);

}  // namespace slabstream
