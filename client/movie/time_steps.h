// The times that a movie shows. Pure.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// Each `step`-th time from `first` on, at most `last`.
struct TimeSteps {
  int first = 0, last = 0, step = 1;  // 0 <= first <= last, step > 0
  int count() const { return (last - first) / step + 1; }
  // The time of a frame with this index in [0, frames), which are spread evenly over the times.
  int At(int index, int frames) const { return first + step * int(std::int64_t{index} * count() / frames); }
};
// "T", "FIRST:LAST" or "FIRST:LAST:STEP". Errors as in common/cli/parse.h.
Result<TimeSteps> ParseTimeSteps(std::string_view option, std::string_view text);

}  // namespace slabstream
