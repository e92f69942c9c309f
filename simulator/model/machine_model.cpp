#include "simulator/model/machine_model.h"

#include <limits>

#include "common/base/range_status.h"

namespace slabstream {

Status Validate(const MachineModel& machine) {
  constexpr double kMaxSeconds = 3600;
  const auto& [link, combining, picture, wake_ups, workers_a_host, cores_a_host, memory_slowdown, plan_seconds, message_seconds,
               client_seconds] = machine;
  const struct {
    const char* field;
    double value, least, most;
  } limits[] = {
      {"link.latency_seconds", link.latency_seconds, 0, kMaxSeconds},
      {"link.bytes_per_second", link.bytes_per_second, 1, 1e15},
      {"link.ports", double(link.ports), 1, 1 << 20},
      {"link.oversubscription", link.oversubscription, 1e-3, 1e6},
      {"combining.scan_pixel", combining.scan_pixel, 0, kMaxSeconds},
      {"combining.encode_pixel", combining.encode_pixel, 0, kMaxSeconds},
      {"combining.combine_pixel", combining.combine_pixel, 0, kMaxSeconds},
      {"combining.local_pixel", combining.local_pixel, 0, kMaxSeconds},
      {"combining.hidden_pixel", combining.hidden_pixel, 0, kMaxSeconds},
      {"combining.cipher_byte", combining.cipher_byte, 0, kMaxSeconds},
      {"combining.run_bytes", double(combining.run_bytes), 0, 1024},
      {"combining.rgba_bytes", double(combining.rgba_bytes), 0, 1024},
      {"combining.depth_bytes", double(combining.depth_bytes), 0, 1024},
      {"wake_ups.awake", wake_ups.awake, 0, kMaxSeconds},
      {"wake_ups.asleep", wake_ups.asleep, 0, kMaxSeconds},
      {"wake_ups.doze", wake_ups.doze, 0, std::numeric_limits<double>::max()},
      {"picture.link_byte", picture.link_byte, 0, kMaxSeconds},
      {"picture.cipher_byte", picture.cipher_byte, 0, kMaxSeconds},
      {"workers_a_host", double(workers_a_host), 0, 1 << 20},
      {"cores_a_host", double(cores_a_host), 1, 1 << 20},
      {"memory_slowdown", memory_slowdown, 0, 1},
      {"plan_seconds", plan_seconds, 0, kMaxSeconds},
      {"message_seconds", message_seconds, 0, kMaxSeconds},
      {"client_seconds", client_seconds, 0, kMaxSeconds},
  };
  for (const auto& [field, value, least, most] : limits) {
    if (Status status = InRange(field, value, least, most); !status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace slabstream
