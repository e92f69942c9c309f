#include "data/volume_io/page_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace slabstream {

std::int64_t PageLayout::NumberOf(std::int64_t slice, std::int64_t channel, std::int64_t time) const {
  std::int64_t number = 0, step = 1;
  for (const char axis : order) {
    number += step * (axis == 'Z' ? slice : axis == 'C' ? channel : time);
    step *= axis == 'Z' ? slices : axis == 'C' ? channels : times;
  }
  return number;
}

bool PageLayout::RunsFit() const {
  std::vector<std::pair<std::int64_t, std::int64_t>> ranges;  // half open
  for (const PageRun& run : runs) {
    if (run.count == 0) return true;
    const std::int64_t first = NumberOf(run.slice, run.channel, run.time);
    ranges.emplace_back(first, first + run.count);
  }
  std::ranges::sort(ranges);
  std::int64_t end = 0;
  for (const auto& [first, behind] : ranges) {
    if (first != end) return false;
    end = behind;
  }
  return end == planes();
}

std::string PageLayout::Text() const {
  const auto counted = [](std::int64_t count, const char* what) { return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s"); };
  return fmt::format("{}, {} and {}", counted(slices, "slice"), counted(channels, "channel"), counted(times, "time"));
}

}  // namespace slabstream
