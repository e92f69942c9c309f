#include "coordinator/tuning/service_machine.h"

#include <algorithm>

#include "common/calibration/calibration.h"

namespace slabstream {
namespace {

// Pixels stay where they are: only the beginnings and ends of rows are sent.
void LendImages(MachineModel& machine) {
  machine.link.bytes_per_second = 1e12;
  machine.combining = {.scan_pixel = calibration::combining::kLentScan,
                       .encode_pixel = 0,
                       .combine_pixel = calibration::combining::kLentCombine,
                       .local_pixel = calibration::combining::kLentLocal,
                       .run_bytes = 8,
                       .rgba_bytes = 0,
                       .depth_bytes = 0,
                       .lent = true};
}

}  // namespace

LinkModel DefaultLink() { return ParseLink("link", kDefaultLink).value(); }

MachineModel ServiceMachine(std::span<const HostedWorker> workers, const ServiceSurroundings& surroundings) {
  MachineModel machine;
  std::uint32_t threads = 0, least_threads = workers.empty() ? 1 : workers.front().threads;
  for (const HostedWorker& worker : workers) {
    threads += worker.threads;
    least_threads = std::min(least_threads, worker.threads);
  }
  machine.threads = std::int32_t(std::max<std::uint32_t>(least_threads, 1));
  const bool one_host = std::ranges::all_of(
      workers, [&](const HostedWorker& worker) { return worker.memory_scope != 0 && worker.memory_scope == workers.front().memory_scope; });
  if (surroundings.encrypted) machine.combining.cipher_byte = calibration::service::kCipherByte;
  if (!one_host) {
    machine.link = surroundings.link;
    return machine;
  }
  machine.link = {Contention::kNone, 0, calibration::service::kLoopbackRate};
  if (std::ranges::all_of(workers, &HostedWorker::lends_memory)) LendImages(machine);
  machine.plan_seconds = machine.message_seconds = machine.client_seconds = 0;  // in the wake-ups, which are measured as a whole
  const bool coordinators_host = !workers.empty() && workers.front().memory_scope == surroundings.memory_scope;
  machine.workers_a_host = std::int32_t(std::max<std::size_t>(workers.size(), 1));
  machine.cores_a_host = std::max<std::int32_t>(coordinators_host ? surroundings.cores : std::int32_t(threads), 1);
  machine.memory_slowdown = calibration::service::kMemorySlowdown;
  const bool one_process =
      std::ranges::all_of(workers, [&](const HostedWorker& worker) { return worker.pid != 0 && worker.pid == workers.front().pid; });
  if (one_process) machine.picture_threads = std::min(machine.workers_a_host * machine.threads, machine.cores_a_host);
  return machine;
}

}  // namespace slabstream
