#include <algorithm>
#include <utility>

#include "common/combining/schedule.h"

namespace slabstream {

// In round r neighbouring intervals of 2^r ranks meet. An interval is held by the root if that lies in it, else by its first rank.
Schedule MakeFanIn(const ScheduleRequest& request) {
  Schedule schedule = {request.ranks, request.root, {}};
  const std::uint64_t ranks = request.ranks;
  const auto holder = [&](std::uint64_t begin, std::uint64_t end) {
    return request.root >= begin && request.root < end ? request.root : Rank(begin);
  };
  std::uint32_t round = 0;
  for (std::uint64_t width = 1; width < ranks; width *= 2, ++round) {
    for (std::uint64_t begin = 0; begin + width < ranks; begin += 2 * width) {
      const std::uint64_t middle = begin + width, end = std::min(begin + 2 * width, ranks);
      Rank to = holder(begin, middle), from = holder(middle, end);
      if (from == request.root) std::swap(from, to);
      schedule.steps.push_back({round, from, to, request.pixels});
    }
  }
  return schedule;
}

}  // namespace slabstream
