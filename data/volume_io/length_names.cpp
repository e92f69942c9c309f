#include "data/volume_io/length_names.h"

#include <algorithm>
#include <array>
#include <string>

#include "common/base/find_named.h"
#include "common/base/trimmed.h"
#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// The first name of a unit is the one that is written.
struct UnitName {
  std::string_view name;
  LengthUnit unit;
};
constexpr std::array<UnitName, 16> kUnitNames = {{
    {"mm", LengthUnit::kMillimetre},
    {"millimetre", LengthUnit::kMillimetre},
    {"um", LengthUnit::kMicrometre},
    {"\u00b5m", LengthUnit::kMicrometre},  // the micro sign
    {"\u03bcm", LengthUnit::kMicrometre},  // the Greek letter
    {"micron", LengthUnit::kMicrometre},
    {"micrometre", LengthUnit::kMicrometre},
    {"nm", LengthUnit::kNanometre},
    {"nanometre", LengthUnit::kNanometre},
    {"angstrom", LengthUnit::kAngstrom},
    {"\u00c5", LengthUnit::kAngstrom},  // the letter
    {"\u212b", LengthUnit::kAngstrom},  // the sign
    {"cm", LengthUnit::kCentimetre},
    {"centimetre", LengthUnit::kCentimetre},
    {"m", LengthUnit::kMetre},
    {"metre", LengthUnit::kMetre},
}};

}  // namespace

std::optional<LengthUnit> LengthUnitNamed(std::string_view name) {
  std::string one = ToLower(std::string(Trimmed(name)));
  if (one.ends_with('s')) one.pop_back();
  if (const std::size_t at = one.find("meter"); at != std::string::npos) one.replace(at, 5, "metre");
  const UnitName* const found = FindNamed(kUnitNames, one);
  return found == nullptr ? std::nullopt : std::optional(found->unit);
}

std::string_view FileNameOf(LengthUnit unit) { return std::ranges::find(kUnitNames, unit, &UnitName::unit)->name; }

}  // namespace slabstream
