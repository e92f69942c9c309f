#include "laboratory/measure/paper_model.h"

#include <bit>

#include "common/base/check.h"

namespace slabstream {

int CombiningRounds(std::string_view combine, int workers) {
  CHECK(workers >= 1) << workers;
  if (combine == "centralized") return workers - 1;
  CHECK(combine == "fan-in") << combine;
  return int(std::bit_width(unsigned(workers) - 1));
}

double PaperModel::CombineSeconds(std::string_view combine, int workers) const { return round_seconds * CombiningRounds(combine, workers); }

double PaperModel::FrameSeconds(std::string_view combine, int workers) const {
  return one_worker_seconds / workers + CombineSeconds(combine, workers);
}

MachineModel PaperMachine(const PaperModel& model, double frame_seconds, double pixels) {
  // Almost at once, but the simulation wants causes to come before effects.
  constexpr double kLatency = 1e-9, kBytesPerSecond = 1e15;
  MachineModel machine;
  // A round's time is that of its receiver, who combines one image after the other.
  const double pixel = model.round_seconds / model.one_worker_seconds * frame_seconds / pixels;
  machine.combining = {.scan_pixel = 0, .encode_pixel = 0, .combine_pixel = pixel, .local_pixel = pixel, .hidden_pixel = 0};
  machine.link = {.contention = Contention::kNone, .latency_seconds = kLatency, .bytes_per_second = kBytesPerSecond};
  machine.wake_ups = {.awake = 0, .asleep = 0};
  machine.workers_a_host = machine.cores_a_host = 1;
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;
  return machine;
}

}  // namespace slabstream
