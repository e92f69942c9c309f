#include "client/cli/slurm_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr int kMinute = 60, kHour = 60 * kMinute, kDay = 24 * kHour;

// A number of [0, limit) of digits alone.
std::optional<std::int64_t> Digits(std::string_view text, std::int64_t limit) {
  if (text.empty() || !std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; })) return std::nullopt;
  const std::optional<std::int64_t> value = ParseNumber<std::int64_t>(text);
  return value && *value < limit ? value : std::nullopt;
}

// The seconds of "A", "A:B" or "A:B:C", whose numbers count `units` (in seconds). The first is below `first_limit`, each other one below
// the unit before it.
std::optional<std::int64_t> Colons(std::string_view text, const std::vector<int>& units, std::int64_t first_limit) {
  std::int64_t seconds = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0;; ++i) {
    if (i == units.size()) return std::nullopt;
    const std::size_t end = text.find(':', begin);
    const std::optional<std::int64_t> value = Digits(text.substr(begin, end - begin), i == 0 ? first_limit : units[i - 1] / units[i]);
    if (!value) return std::nullopt;
    seconds += *value * units[i];
    if (end == std::string_view::npos) return seconds;
    begin = end + 1;
  }
}

std::optional<std::int64_t> SecondsOf(std::string_view text) {
  constexpr std::int64_t kAny = 1000000;
  if (const std::size_t dash = text.find('-'); dash != std::string_view::npos) {
    const std::optional<std::int64_t> days = Digits(text.substr(0, dash), kAny);
    const std::optional<std::int64_t> rest = Colons(text.substr(dash + 1), {kHour, kMinute, 1}, kDay / kHour);
    return days && rest ? std::optional(*days * kDay + *rest) : std::nullopt;
  }
  return std::ranges::count(text, ':') == 2 ? Colons(text, {kHour, kMinute, 1}, kAny) : Colons(text, {kMinute, 1}, kAny);
}

}  // namespace

Result<TimeLimit> ParseTimeLimit(std::string_view option, std::string_view text) {
  const std::optional<std::int64_t> seconds = SecondsOf(text);
  if (!seconds)
    return Status::InvalidArgument(fmt::format("{} '{}' is no time of Slurm, such as 90 (minutes), 1:30:00 or 2-12:00:00", option, text));
  if (*seconds < kMinute || *seconds > 365 * kDay)
    return Status::InvalidArgument(fmt::format("{} {} is out of range [1 minute, 365 days]", option, text));
  return TimeLimit{std::string(text), int(*seconds)};
}

Result<std::string> ParseDirective(std::string_view option, std::string_view text) {
  constexpr std::array<std::string_view, 3> kDecided = {"array", "nodes", "ntasks"};
  const auto refused = [&](std::string_view why) {
    std::string shown(text);
    std::ranges::replace_if(
        shown, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
    return Status::InvalidArgument(fmt::format("{} '{}' {}", option, shown, why));
  };
  if (std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 0x7f; })) return refused("has a control character");
  if (text.starts_with("--")) text.remove_prefix(2);
  const std::string_view name = text.substr(0, text.find('='));
  const bool well_formed = !name.empty() && name.front() != '-' &&
                           std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; });
  if (!well_formed) return refused("is no long option of sbatch, such as partition=long or exclusive");
  if (std::ranges::find(kDecided, name) != kDecided.end()) return refused("is decided by --nodes and --workers-per-node");
  return fmt::format("--{}", text);
}

}  // namespace slabstream
