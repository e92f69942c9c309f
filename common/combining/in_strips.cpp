#include <algorithm>

#include "common/combining/steps.h"

namespace slabstream {

Schedule InStrips(Schedule schedule, std::uint32_t strips, std::uint32_t most_steps) {
  if (schedule.steps.empty()) return schedule;
  const PixelRange pixels = schedule.steps.front().pixels;
  const std::uint64_t count =
      std::max<std::uint64_t>(1, std::min<std::uint64_t>({strips, most_steps / schedule.steps.size(), pixels.end - pixels.begin}));
  Schedule result = {schedule.ranks, schedule.roots, {}};
  result.steps.reserve(count * schedule.steps.size());
  for (const Step& step : schedule.steps) {
    for (std::uint32_t strip = 0; strip < count; ++strip) {
      result.steps.push_back({step.round + strip, step.from, step.to, Share(pixels, strip, count)});
    }
  }
  std::ranges::stable_sort(result.steps, {}, &Step::round);
  return result;
}

}  // namespace slabstream
