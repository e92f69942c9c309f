// LinkModel: how long a message from one worker to another takes, and which messages wait for each other.
//
// A message of b bytes from one end to another passes one or more wires in turn, cut-through: its first byte reaches the next wire without
// waiting for its last. Each wire carries one message at a time, in the order of sending, at its own rate. The last byte of a message
// arrives `latency` after it has left the slowest wire.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

enum class Contention : std::uint8_t {
  kSharedBus = 1,  // one wire for everybody (Yagel and Machiraju, Eq. 19: reads and writes are sequentialised)
  kSwitched = 2,   // a wire out of and a wire into each end; the switch itself is never full
  kFatTree = 3,    // switched within a group of ports; between groups also the wire up from the one and the wire down to the other
  kNone = 4,       // messages never wait for each other: copies that the ends make themselves
};

struct LinkModel {
  Contention contention = Contention::kSwitched;
  double latency_seconds = 0;     // time of one message before any byte is counted; >= 0
  double bytes_per_second = 1e9;  // the rate of a wire; > 0
  // kFatTree: ends that share an uplink, and the ratio of their total rate to the uplink's.
  std::int32_t ports = 16;
  double oversubscription = 4;
  friend bool operator==(const LinkModel&, const LinkModel&) = default;
};

struct LinkPreset {
  std::string_view name;  // what sweeps and ParseLink take
  LinkModel link;
};

// The only list.
const std::vector<LinkPreset>& LinkPresets();

// "NAME" or "NAME:LATENCY,RATE": a preset, or its kind of contention with a latency in microseconds, [0, 1e6], and 10^9 bits a second,
// (0, 1e6]. InvalidArgument names the text and what is expected. `option` is what messages call it.
Result<LinkModel> ParseLink(std::string_view option, std::string_view text);

}  // namespace slabstream
