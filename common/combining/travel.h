// How far pixels travel in a schedule.
#pragma once

#include <cstdint>

#include "common/combining/named_schedule.h"

namespace slabstream {

// How often pixels are passed on, at most over all pixels of the result: one after the other on the way of any one rank's colours, and
// altogether.
struct Travel {
  std::uint32_t hops = 0, transfers = 0;
  friend bool operator==(const Travel&, const Travel&) = default;
};
Travel TravelOf(const SharedSchedule& schedule, PixelRange pixels);

}  // namespace slabstream
