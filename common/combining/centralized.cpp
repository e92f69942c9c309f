#include <algorithm>

#include "common/combining/schedule.h"

namespace slabstream {

// The root takes its neighbours from the inside out, so that its interval grows by one rank a round.
Schedule MakeCentralized(const ScheduleRequest& request) {
  Schedule schedule = {request.ranks, request.root, {}};
  const Rank before = request.root, after = request.ranks > request.root ? request.ranks - request.root - 1 : 0;
  std::uint32_t round = 0;
  for (Rank distance = 1; distance <= std::max(before, after); ++distance) {
    if (distance <= before) schedule.steps.push_back({round++, request.root - distance, request.root, request.pixels});
    if (distance <= after) schedule.steps.push_back({round++, request.root + distance, request.root, request.pixels});
  }
  return schedule;
}

}  // namespace slabstream
