// How far pixels travel in a schedule.
#pragma once

#include <cstdint>

#include "common/combining/named_schedule.h"

namespace slabstream {

// How often a pixel of the result is passed on, at most: in sequence, on the way of any one rank's colours (hops), and in all (transfers).
struct Travel {
  std::uint32_t hops = 0, transfers = 0;
  friend bool operator==(const Travel&, const Travel&) = default;
};
Travel TravelOf(const SharedSchedule& schedule, PixelRange pixels);

}  // namespace slabstream
