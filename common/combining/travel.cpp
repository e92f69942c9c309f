#include "common/combining/travel.h"

#include <algorithm>
#include <optional>

#include "common/combining/schedule_runner.h"

namespace slabstream {

Travel TravelOf(const SharedSchedule& schedule, PixelRange pixels) {
  Travel most;
  const Rank ranks = schedule->schedule().ranks;
  if (ranks == 0) return most;
  ScheduleRunner<Travel> runner(schedule, pixels, AllRanks(ranks));
  for (Rank rank = 0; rank < ranks; ++rank) runner.OnRendered(rank, {});
  while (const auto taken = runner.TakeNext()) {
    for (const Fragment<Travel>& part : taken->parts) {
      const Travel arrived = {part.value.hops + 1, part.value.transfers + 1};
      runner.held(taken->step->to).Combine({part.pixels, arrived}, [](const Travel& a, const Travel& b) -> std::optional<Travel> {
        return Travel{std::max(a.hops, b.hops), a.transfers + b.transfers};
      });
    }
  }
  const std::vector<Rank>& roots = schedule->schedule().roots;
  for (std::size_t share = 0; share < roots.size(); ++share) {
    for (const Fragment<Travel>& fragment : runner.held(roots[share]).Take(Share(pixels, share, roots.size()))) {
      most = {std::max(most.hops, fragment.value.hops), std::max(most.transfers, fragment.value.transfers)};
    }
  }
  return most;
}

}  // namespace slabstream
