// Calibrate: the machine model of this host, measured in about two seconds.
//
//   combining   the operators that a worker's combining thread runs (combining_costs.h)
//   wake-ups    frames of the embedded service with tiny pictures (wake_up_probe.h)
#pragma once

#include "common/base/status.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

inline constexpr int kCalibrationSamples = 40;  // of wake-ups

// For `workers` workers of the embedded service with one render thread each; they share the available cores and lend each other their
// images. Fails with the service.
Result<MachineModel> CalibrateThisHost(int workers);

// The same without the measurement that takes frames: wake-ups keep their defaults.
MachineModel ThisHost(int workers);

}  // namespace slabstream
