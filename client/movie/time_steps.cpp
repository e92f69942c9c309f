#include "client/movie/time_steps.h"

#include "common/cli/parse.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

Result<TimeSteps> ParseTimeSteps(std::string_view option, std::string_view text) {
  const std::size_t first = text.find(':'), second = first == std::string_view::npos ? first : text.find(':', first + 1);
  const Result<TimeRange> range = ParseTimeRange(option, text.substr(0, second));
  if (!range.ok()) return range.status();
  if (second == std::string_view::npos) return TimeSteps{range->first, range->last};
  const Result<int> step = ParseInteger(option, text.substr(second + 1), 1, int(kMaxVolumes));
  if (!step.ok()) return step.status();
  return TimeSteps{range->first, range->last, *step};
}

}  // namespace slabstream
