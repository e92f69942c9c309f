#include <algorithm>
#include <vector>

#include "common/combining/steps.h"

namespace slabstream {

Schedule MakeTree(const ScheduleRequest& request, std::uint32_t k, std::uint32_t strips) {
  Schedule whole = {request.ranks, {request.root}, {}};
  std::vector<Rank> holders(request.ranks);  // of the intervals that have met so far, in order
  for (Rank rank = 0; rank < request.ranks; ++rank) holders[rank] = rank;
  std::uint32_t first_round = 0;
  for (std::uint64_t place = request.root; holders.size() > 1; place /= k) {  // place: of the root's interval
    std::uint32_t next_round = first_round;
    std::vector<Rank> met;
    for (std::size_t begin = 0; begin < holders.size(); begin += k) {
      const auto count = std::uint32_t(std::min<std::size_t>(k, holders.size() - begin));
      const auto to = std::min(std::uint32_t(place % k), count - 1);
      std::uint32_t round = first_round;  // one for each image that is taken: a rank takes one whole image at a time
      ForEachInsideOut(to, count, [&](std::uint32_t from) {
        whole.steps.push_back({round++, holders[begin + from], holders[begin + to], request.pixels});
      });
      next_round = std::max(next_round, round);
      met.push_back(holders[begin + to]);
    }
    holders = std::move(met);
    first_round = next_round;
  }
  std::ranges::stable_sort(whole.steps, {}, &Step::round);
  return InStrips(std::move(whole), strips, request.most_steps);
}

}  // namespace slabstream
