#include "data/volume_io/length_names.h"

#include <algorithm>
#include <array>
#include <string>

#include "common/base/find_named.h"
#include "common/text/trimmed.h"
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

std::optional<double> MicrometresIn(std::string_view name) {
  struct NamedLength {
    std::string_view name;
    double micrometres;
  };
  static constexpr NamedLength kPrefixes[] = {{"Y", 1e30}, {"Z", 1e27}, {"E", 1e24},  {"P", 1e21},   {"T", 1e18},   {"G", 1e15},
                                              {"M", 1e12}, {"k", 1e9},  {"h", 1e8},   {"da", 1e7},   {"", 1e6},     {"d", 1e5},
                                              {"c", 1e4},  {"m", 1e3},  {"u", 1},     {"\u00b5", 1}, {"\u03bc", 1}, {"n", 1e-3},
                                              {"p", 1e-6}, {"f", 1e-9}, {"a", 1e-12}, {"z", 1e-15},  {"y", 1e-18}};
  static constexpr NamedLength kOthers[] = {{"in", 25400},          {"inch", 25400},       {"inche", 25400},    {"ft", 304800},
                                            {"foot", 304800},       {"yd", 914400},        {"yard", 914400},    {"mi", 1609344e3},
                                            {"mile", 1609344e3},    {"thou", 25.4},        {"li", 25400. / 12}, {"pt", 25400. / 72},
                                            {"point", 25400. / 72}, {"ua", 149597870700e6}};
  if (const std::optional<LengthUnit> unit = LengthUnitNamed(name)) {
    switch (*unit) {
      case LengthUnit::kMetre: return 1e6;
      case LengthUnit::kCentimetre: return 1e4;
      case LengthUnit::kMillimetre: return 1e3;
      case LengthUnit::kMicrometre: return 1;
      case LengthUnit::kNanometre: return 1e-3;
      case LengthUnit::kAngstrom: return 1e-4;
      default: return std::nullopt;
    }
  }
  if (name.ends_with('m')) {
    if (const NamedLength* const prefix = FindNamed(kPrefixes, name.substr(0, name.size() - 1))) return prefix->micrometres;
  }
  if (name.ends_with('s')) name.remove_suffix(1);
  const NamedLength* const found = FindNamed(kOthers, name);
  return found == nullptr ? std::nullopt : std::optional(found->micrometres);
}

std::string_view FileNameOf(LengthUnit unit) { return std::ranges::find(kUnitNames, unit, &UnitName::unit)->name; }

double MetresIn(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMillimetre: return 1e-3;
    case LengthUnit::kMicrometre: return 1e-6;
    case LengthUnit::kNanometre: return 1e-9;
    case LengthUnit::kAngstrom: return 1e-10;
    case LengthUnit::kCentimetre: return 1e-2;
    default: return 1;
  }
}

}  // namespace slabstream
