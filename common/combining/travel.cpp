#include <algorithm>
#include <vector>

#include "common/combining/fragments.h"
#include "common/combining/schedule.h"

namespace slabstream {

Travel TravelOf(const Schedule& schedule, PixelRange pixels) {
  std::vector<Fragments<Travel>> held(schedule.ranks);
  for (Fragments<Travel>& rank : held) rank.Put(pixels, {});
  for (const Step& step : schedule.steps) {
    for (const auto& [begin, moved] : held[step.from].Take(step.pixels)) {
      const Travel arrived = {moved.value.hops + 1, moved.value.transfers + 1};
      held[step.to].Combine({begin, moved.end}, arrived, [](const Travel& a, const Travel& b) -> std::optional<Travel> {
        return Travel{std::max(a.hops, b.hops), a.transfers + b.transfers};
      });
    }
  }
  Travel most;
  if (schedule.ranks == 0) return most;
  for (const auto& [begin, fragment] : held[schedule.root].fragments()) {
    most = {std::max(most.hops, fragment.value.hops), std::max(most.transfers, fragment.value.transfers)};
  }
  return most;
}

}  // namespace slabstream
