// Calibrate: the machine model of this host, measured in about two seconds.
//
//   combining   the operators that a worker's combining thread runs, in this process
//   wake-ups    frames of the embedded service with tiny pictures (wake_up_probe.h)
#pragma once

#include "common/base/status.h"
#include "common/image/pixel_format.h"
#include "simulator/model/machine_model.h"

namespace slabstream {

// How the pixels of a partial image travel from one worker to another.
enum class ImageTransfer {
  kLent,     // between workers of one host: they stay where they are and are read there
  kMessage,  // between hosts: as runs, in the message
};

// The time that a worker's combining thread takes per pixel: processor time, medians of several runs on pictures that are full and half
// empty. As in frames, the pixels are not in this core's caches (incoming ones were written by another core, and rendering has run on this
// one since), and an image becomes as large as the frame when the first other one is combined into it. The costs of finding hidden tiles
// are those of colour images; others have none.
CombiningCosts MeasureCombining(ImageTransfer transfer, PixelFormat format = PixelFormat::kRgba);

inline constexpr int kCalibrationSamples = 40;  // of wake-ups

// For `workers` workers of the embedded service with one render thread each; they share the available cores and lend each other their
// images. Fails with the service.
Result<MachineModel> CalibrateThisHost(int workers);

// The same without the measurement that takes frames: wake-ups keep their defaults.
MachineModel ThisHost(int workers);

}  // namespace slabstream
