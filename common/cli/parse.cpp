#include "common/cli/parse.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>

#include "common/base/did_you_mean.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

// The whole text as a number, or nothing. A leading '+' is fine.
template <class T>
std::optional<T> Convert(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return ParseNumber<T>(text);
}

// Shortest text that reads back the same; {} of fmt does that for doubles ("0.001", not "0.0010000000000000000208").
std::string RangeText(const NumberRange& range) { return fmt::format("{}{}, {}]", range.min_open ? '(' : '[', range.min, range.max); }

}  // namespace

Result<double> ParseNumber(std::string_view option, std::string_view text, const NumberRange& range) {
  const std::optional<double> value = Convert<double>(text);
  if (!value || std::isnan(*value)) return Status::InvalidArgument(fmt::format("{} '{}' is not a number", option, text));
  if (*value < range.min || *value > range.max || (range.min_open && *value == range.min)) {
    return Status::InvalidArgument(fmt::format("{} {} is out of range {}", option, text, RangeText(range)));
  }
  return *value;
}

Result<int> ParseInteger(std::string_view option, std::string_view text, int min, int max) {
  const std::optional<long long> value = Convert<long long>(text);
  if (!value) return Status::InvalidArgument(fmt::format("{} '{}' is not a whole number in [{}, {}]", option, text, min, max));
  if (*value < min || *value > max) {
    return Status::InvalidArgument(fmt::format("{} {} is out of range [{}, {}]", option, text, min, max));
  }
  return int(*value);
}

Result<Duration> ParseDuration(std::string_view option, std::string_view text, Duration max) {
  using std::chrono::milliseconds;
  struct Unit {
    std::string_view name;
    Duration length;
  };
  constexpr std::array<Unit, 4> kUnits = {
      {{"ms", milliseconds(1)}, {"s", std::chrono::seconds(1)}, {"m", std::chrono::minutes(1)}, {"h", std::chrono::hours(1)}}};
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  const std::optional<std::int64_t> count = ParseNumber<std::int64_t>(text.substr(0, digits));
  const auto unit = std::ranges::find(kUnits, text.substr(digits), &Unit::name);
  if (!count || unit == kUnits.end()) {
    return Status::InvalidArgument(fmt::format("{} '{}' is not a time such as 500ms, 30s, 2m or 1h", option, text));
  }
  if (*count > max / unit->length) {
    return Status::InvalidArgument(
        fmt::format("{} {} is out of range [0, {} s]", option, text, std::chrono::duration_cast<std::chrono::seconds>(max).count()));
  }
  return *count * unit->length;
}

Result<std::size_t> ParseChoice(std::string_view option, std::string_view text, std::span<const std::string_view> choices) {
  const auto found = std::find(choices.begin(), choices.end(), text);
  if (found != choices.end()) return std::size_t(found - choices.begin());
  return Status::InvalidArgument(
      fmt::format("{} '{}' is not one of {}{}", option, text, fmt::join(choices, ", "), DidYouMean(text, choices)));
}

}  // namespace slabstream
