#include "simulator/model/machine_model.h"

#include <fmt/format.h>

#include <limits>

#include "common/base/range_status.h"

namespace slabstream {
namespace {

constexpr double kMaxSeconds = 3600;

Status Validate(const LinkModel& link) {
  if (Status s = InRange("link.latency_seconds", link.latency_seconds, 0, kMaxSeconds); !s.ok()) return s;
  if (Status s = InRange("link.bytes_per_second", link.bytes_per_second, 1, 1e15); !s.ok()) return s;
  if (Status s = InRange("link.ports", link.ports, 1, 1 << 20); !s.ok()) return s;
  return InRange("link.oversubscription", link.oversubscription, 1e-3, 1e6);
}

Status Validate(const CombiningCosts& costs) {
  const std::pair<const char*, double> seconds[] = {
      {"combining.scan_pixel", costs.scan_pixel},       {"combining.encode_pixel", costs.encode_pixel},
      {"combining.combine_pixel", costs.combine_pixel}, {"combining.local_pixel", costs.local_pixel},
      {"combining.hidden_pixel", costs.hidden_pixel},   {"combining.cipher_byte", costs.cipher_byte}};
  for (const auto& [field, value] : seconds) {
    if (Status s = InRange(field, value, 0, kMaxSeconds); !s.ok()) return s;
  }
  if (Status s = InRange("combining.run_bytes", costs.run_bytes, 0, 1024); !s.ok()) return s;
  if (Status s = InRange("combining.rgba_bytes", costs.rgba_bytes, 0, 1024); !s.ok()) return s;
  return InRange("combining.depth_bytes", costs.depth_bytes, 0, 1024);
}

Status Validate(const WakeUps& costs) {
  if (Status s = InRange("wake_ups.awake", costs.awake, 0, kMaxSeconds); !s.ok()) return s;
  if (Status s = InRange("wake_ups.asleep", costs.asleep, 0, kMaxSeconds); !s.ok()) return s;
  return InRange("wake_ups.doze", costs.doze, 0, std::numeric_limits<double>::max());
}

}  // namespace

Status Validate(const MachineModel& machine) {
  if (Status s = Validate(machine.link); !s.ok()) return s;
  if (Status s = Validate(machine.combining); !s.ok()) return s;
  if (Status s = Validate(machine.wake_ups); !s.ok()) return s;
  if (Status s = InRange("picture.link_byte", machine.picture.link_byte, 0, kMaxSeconds); !s.ok()) return s;
  if (Status s = InRange("picture.cipher_byte", machine.picture.cipher_byte, 0, kMaxSeconds); !s.ok()) return s;
  for (const double speed : machine.speeds) {
    if (Status s = InRange("speeds", speed, 1e-6, 1e6); !s.ok()) return s;
  }
  if (Status s = InRange("stragglers.probability", machine.stragglers.probability, 0, 1); !s.ok()) return s;
  if (Status s = InRange("stragglers.factor", machine.stragglers.factor, 1, 1e6); !s.ok()) return s;
  if (Status s = InRange("threads", machine.threads, 1, 4096); !s.ok()) return s;
  if (Status s = InRange("picture_threads", machine.picture_threads, 0, 4096); !s.ok()) return s;
  if (Status s = InRange("serial_share", machine.serial_share, 0, 1); !s.ok()) return s;
  if (Status s = InRange("workers_a_host", machine.workers_a_host, 0, 1 << 20); !s.ok()) return s;
  if (Status s = InRange("cores_a_host", machine.cores_a_host, 1, 1 << 20); !s.ok()) return s;
  if (Status s = InRange("memory_slowdown", machine.memory_slowdown, 0, 1); !s.ok()) return s;
  if (Status s = InRange("plan_seconds", machine.plan_seconds, 0, kMaxSeconds); !s.ok()) return s;
  if (Status s = InRange("message_seconds", machine.message_seconds, 0, kMaxSeconds); !s.ok()) return s;
  return InRange("client_seconds", machine.client_seconds, 0, kMaxSeconds);
}

}  // namespace slabstream
