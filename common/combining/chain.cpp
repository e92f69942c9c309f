#include <algorithm>

#include "common/combining/steps.h"

namespace slabstream {

// Arms of equal length would bring the same strip to the root in one round: there the arm in front comes a round later.
Schedule MakeChain(const ScheduleRequest& request, std::uint32_t strips) {
  Schedule whole = {request.ranks, {request.root}, {}};
  if (request.ranks < 2) return whole;
  const Rank last = request.ranks - 1;
  for (Rank from = last; from > request.root; --from) whole.steps.push_back({last - from, from, from - 1, request.pixels});
  const bool same_round = 2 * request.root == last;
  for (Rank from = 0; from < request.root; ++from) {
    const bool meets = same_round && from + 1 == request.root;
    whole.steps.push_back({from + (meets ? 1U : 0U), from, from + 1, request.pixels});
  }
  std::ranges::stable_sort(whole.steps, {}, &Step::round);
  return InStrips(std::move(whole), strips, request.most_steps);
}

}  // namespace slabstream
