#include "laboratory/measure/calibrate.h"

#include <algorithm>
#include <thread>

#include "laboratory/measure/combining_costs.h"
#include "laboratory/measure/wake_up_probe.h"

namespace slabstream {

MachineModel ThisHost(int workers) {
  MachineModel machine;
  machine.combining = MeasureCombining(ImageTransfer::kLent);
  machine.link = {Contention::kNone, 0, 1e12};  // pixels stay where they are
  // The wake-ups to and from the coordinator include its work.
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  machine.workers_a_host = workers;
  machine.cores_a_host = int(std::max(std::thread::hardware_concurrency(), 1U));
  return machine;
}

Result<MachineModel> CalibrateThisHost(int workers) {
  WakeUpProbe probe;
  if (Status status = probe.Sample(kCalibrationSamples); !status.ok()) return status;
  MachineModel machine = ThisHost(workers);
  machine.wake_ups = probe.Estimates().Costs();
  return machine;
}

}  // namespace slabstream
