#include "simulator/model/network.h"

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {

Network::Network(const LinkModel& link, std::uint32_t ends) : link_(link), ends_(ends) {
  const Wire plain{link.bytes_per_second, 0};
  switch (link.contention) {
    case Contention::kNone: break;
    case Contention::kSharedBus: wires_.assign(1, plain); break;
    case Contention::kSwitched: wires_.assign(2 * std::size_t(ends), plain); break;
    case Contention::kFatTree: {
      const std::uint32_t ports = std::uint32_t(link.ports), groups = (ends + ports - 1) / ports;
      wires_.assign(2 * std::size_t(ends), plain);
      wires_.resize(wires_.size() + 2 * std::size_t(groups), {link.bytes_per_second * link.ports / link.oversubscription, 0});
      break;
    }
  }
}

Network::Path Network::FindPath(std::uint32_t from, std::uint32_t to) const {
  switch (link_.contention) {
    case Contention::kNone: return {{}, 0};
    case Contention::kSharedBus: return {{0}, 1};
    case Contention::kSwitched: return {{from, ends_ + to}, 2};
    case Contention::kFatTree: {
      const std::uint32_t ports = std::uint32_t(link_.ports), groups = (ends_ + ports - 1) / ports;
      if (from / ports == to / ports) return {{from, ends_ + to}, 2};
      return {{from, 2 * ends_ + from / ports, 2 * ends_ + groups + to / ports, ends_ + to}, 4};
    }
  }
  CHECK(false) << "contention " << int(link_.contention);
  return {};
}

Network::Passage Network::Send(std::uint32_t from, std::uint32_t to, double bytes, double now) {
  CHECK(from < ends_ && to < ends_) << "from " << from << " to " << to;
  const Path path = FindPath(from, to);
  Passage passage{now, now};
  if (path.count == 0) passage.end = now + bytes / link_.bytes_per_second;
  double first_byte = now;
  for (int i = 0; i < path.count; ++i) {
    Wire& wire = wires_[path.wires[i]];
    first_byte = std::max(first_byte, wire.free_at);
    if (i == 0) passage.begin = first_byte;
    // Never before its last byte has left the wire in front.
    wire.free_at = std::max(first_byte + bytes / wire.bytes_per_second, passage.end);
    passage.end = wire.free_at;
  }
  passage.end += link_.latency_seconds;
  return passage;
}

}  // namespace slabstream
