// Parses texts of the command line into values. Pure. Every failure is InvalidArgument, one line that names the option, the text and what
// is expected.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "common/base/status.h"
#include "common/base/time.h"

namespace slabstream {

// A closed range, or open below.
struct NumberRange {
  double min = 0, max = 0;
  bool min_open = false;  // the value must be above min
};

Result<double> ParseNumber(std::string_view option, std::string_view text, const NumberRange& range);
Result<int> ParseInteger(std::string_view option, std::string_view text, int min, int max);

// A time such as 500ms, 30s, 2m or 1h, at most `max`.
Result<Duration> ParseDuration(std::string_view option, std::string_view text, Duration max);

// The index of the text in `choices`.
Result<std::size_t> ParseChoice(std::string_view option, std::string_view text, std::span<const std::string_view> choices);

}  // namespace slabstream
