// Calibrate: the machine model of this host, measured in two seconds or so.
//
//   combining     the operators that a worker's combining thread runs, on pictures that are full and half empty
//   hand-overs    frames of the embedded service with tiny pictures, by one worker and by two, less rendering: the first is the path of a
//                 request through coordinator, worker and client, the difference what one partial image adds
//   neighbours    the same box rendered alone and beside another one, for caches and memory are shared
#pragma once

#include "common/base/status.h"
#include "common/planning/frame_plan.h"
#include "common/simulation/machine_model.h"
#include "common/volume/volume.h"

namespace slabstream {

// How the pixels of a partial image get from one worker to another.
enum class Transfer {
  kLent,     // workers of one host: they stay where they are and are read there
  kMessage,  // between hosts: as runs, in the message
};

// CombiningCosts, but for `task`.
CombiningCosts MeasureCombining(Transfer transfer);

// How much slower two threads render `volume`, each half of it, when both do (MachineModel::memory_slowdown), in [0, 1). 0 where there is
// one core.
double MeasureMemorySlowdown(const Volume& volume, const FrameSetup& setup);

// Workers are those of the embedded service, `workers` of them, one render thread each; they share the cores that there are and lend each
// other their images. Fails with the service.
Result<MachineModel> CalibrateThisHost(int workers);

}  // namespace slabstream
