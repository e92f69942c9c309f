#include <algorithm>
#include <vector>

#include "common/combining/steps.h"

namespace slabstream {

Schedule MakeTree(const ScheduleRequest& request, std::uint32_t k, std::uint32_t strips) {
  Schedule whole = {request.ranks, request.root, {}};
  const std::uint64_t ranks = request.ranks;
  // An interval is held by the root if that lies in it, else by its first rank.
  const auto holder = [&](std::uint64_t begin, std::uint64_t end) {
    return request.root >= begin && request.root < end ? request.root : Rank(begin);
  };
  std::uint32_t first_round = 0;
  for (std::uint64_t width = 1; width < ranks; width *= k) {
    std::uint32_t next_round = first_round;
    for (std::uint64_t begin = 0; begin < ranks; begin += k * width) {
      std::vector<Rank> members;
      for (std::uint64_t m = begin; m < std::min(begin + k * width, ranks); m += width)
        members.push_back(holder(m, std::min(m + width, ranks)));
      const auto to = std::uint32_t(std::ranges::find(members, holder(begin, std::min(begin + k * width, ranks))) - members.begin());
      std::uint32_t round = first_round;  // one for each image that is taken: a rank takes one whole image at a time
      ForEachInsideOut(to, std::uint32_t(members.size()), [&](std::uint32_t from) {
        whole.steps.push_back({round++, members[from], members[to], request.pixels});
      });
      next_round = std::max(next_round, round);
    }
    first_round = next_round;
  }
  std::ranges::stable_sort(whole.steps, {}, &Step::round);
  return InStrips(std::move(whole), strips);
}

}  // namespace slabstream
