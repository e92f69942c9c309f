#include "laboratory/measure/calibrate.h"

#include <algorithm>
#include <thread>

#include "common/planning/frame_plan.h"
#include "common/volume/sphere.h"
#include "laboratory/measure/combining_costs.h"
#include "laboratory/measure/neighbours.h"
#include "laboratory/measure/wake_up_probe.h"

namespace slabstream {
namespace {

constexpr int kWakeUpSamples = 40;
constexpr int kSlowdownVolume = 128;

}  // namespace

double ModelSlowdown(double measured) { return std::clamp(measured, 0.0, 0.99); }

MachineModel ThisHost(int workers) {
  MachineModel machine;
  machine.combining = MeasureCombining(Transfer::kLent);
  machine.link = {Contention::kNone, 0, 1e12};  // pixels stay where they are
  // The wake-ups to and from the coordinator include its work.
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  machine.workers_a_host = workers;
  machine.cores_a_host = int(std::max(std::thread::hardware_concurrency(), 1U));
  machine.picture_threads = std::min(workers, machine.cores_a_host);  // as in worker/service/thread_share.h
  return machine;
}

Result<Calibration> CalibrateThisHost(int workers) {
  WakeUpProbe probe;
  if (Status status = probe.Sample(kWakeUpSamples); !status.ok()) return status;
  const Volume sphere = MakeSphere({SphereClass::kFilled, kSlowdownVolume, 0.4}).value();
  FrameRequest request;
  request.dataset = "sphere";
  const Result<FramePlan> plan = PlanFrame(request, 1, Summarize(sphere), Roster{{1}});
  if (!plan.ok()) return plan.status();

  Calibration calibration{ThisHost(workers), probe.Estimates(), MeasureSlowdown(sphere, plan->setup)};
  calibration.machine.wake_ups = calibration.wake_ups.Costs();
  calibration.machine.memory_slowdown = ModelSlowdown(calibration.memory_slowdown.median);
  return calibration;
}

}  // namespace slabstream
