#include "data/volume_io/stated_field.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include "common/base/find_named.h"
#include "common/text/trimmed.h"
#include "data/volume_io/even_steps.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// As UCUM spells it; "": a name that is not known. Symbols are told apart by their case, names are not.
std::string TimeUnitNamed(std::string_view text) {
  struct UnitName {
    std::string_view name, unit;
  };
  static constexpr UnitName kNames[] = {{"s", "s"},           {"sec", "s"},      {"second", "s"},
                                        {"ms", "ms"},         {"msec", "ms"},    {"millisecond", "ms"},
                                        {"us", "us"},         {"usec", "us"},    {"microsecond", "us"},
                                        {"\u00b5s", "us"},    {"\u03bcs", "us"}, {"\u00b5sec", "us"},
                                        {"\u03bcsec", "us"},  {"ns", "ns"},      {"nsec", "ns"},
                                        {"nanosecond", "ns"}, {"ps", "ps"},      {"picosecond", "ps"},
                                        {"min", "min"},       {"minute", "min"}, {"h", "h"},
                                        {"hr", "h"},          {"hour", "h"},     {"d", "d"},
                                        {"day", "d"}};
  std::string name(Trimmed(text));
  if (name.size() > 2) name = ToLower(name);
  if (name.size() > 3 && name.ends_with('s')) name.pop_back();
  const UnitName* const found = FindNamed(kNames, name);
  return found == nullptr ? "" : std::string(found->unit);
}

}  // namespace

std::optional<ValueRange> StatedWindow(double min, double max, const ValueMapping& mapping) {
  if (!(min < max)) return std::nullopt;
  const auto [low, high] = std::minmax({float(mapping.FromStored(min)), float(mapping.FromStored(max))});
  return std::isfinite(low) && std::isfinite(high) && low < high ? std::optional(ValueRange{low, high}) : std::nullopt;
}

std::optional<std::array<float, 3>> StatedColor(double red, double green, double blue) {
  const std::array<double, 3> color = {red, green, blue};
  if (!std::ranges::all_of(color, [](double part) { return part >= 0 && part <= 1; }) || red + green + blue == 0) return std::nullopt;
  return std::array{float(red), float(green), float(blue)};
}

std::optional<std::array<float, 3>> ColorOfBits(std::uint32_t bits) {
  return StatedColor((bits >> 16 & 255) / 255.0, (bits >> 8 & 255) / 255.0, (bits & 255) / 255.0);
}

std::optional<std::array<float, 3>> ColorOfHex(std::string_view text) {
  if (text.starts_with('#')) text.remove_prefix(1);
  std::uint32_t bits = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), bits, 16);
  return text.size() == 6 && error == std::errc() && end == text.data() + text.size() ? ColorOfBits(bits) : std::nullopt;
}

TimeAxis StatedTimes(std::int64_t count, std::optional<double> step, std::string_view unit) {
  TimeAxis times{.count = int(count)};
  if (count == 1 || !step || !(*step > 0) || !std::isfinite(*step)) return times;
  times.unit = TimeUnitNamed(unit);
  if (*step != 1 || !times.unit.empty()) times.step = step;
  return times;
}

TimeAxis StatedTimes(std::int64_t count, const std::vector<double>& values, std::string_view unit) {
  const std::optional<EvenSteps> even = EvenStepsOf(values);
  return StatedTimes(count, even && std::int64_t(values.size()) == count ? std::optional(even->step) : std::nullopt, unit);
}

}  // namespace slabstream
