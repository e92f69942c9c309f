#include "data/sources/axis_kind.h"

#include <fmt/format.h>

#include <array>
#include <string>

#include "data/volume_io/text_header.h"

namespace slabstream {
namespace {

// In the order of AxisKind, each between blanks.
constexpr std::array<std::string_view, 5> kNames = {
    " x lon longitude rlon nav_lon easting col cols column columns ", " y lat latitude rlat nav_lat northing row rows ",
    " z depth lev level levels plev height altitude plane planes slice slices section ", " t time times timepoint timepoints frame frames ",
    " c ch channel channels band bands wavelength "};

}  // namespace

AxisKind AxisNamed(std::string_view name) {
  if (name.find(' ') != std::string_view::npos) return AxisKind::kOther;
  const std::string between_blanks = ToLower(fmt::format(" {} ", name));
  std::size_t kind = 0;
  while (kind < kNames.size() && kNames.at(kind).find(between_blanks) == std::string_view::npos) ++kind;
  return AxisKind(kind);
}

std::string_view NameOf(AxisKind kind) {
  static constexpr std::array<std::string_view, 6> kKindNames = {"x", "y", "z", "time", "channel", "none"};
  return kKindNames.at(std::size_t(kind));
}

}  // namespace slabstream
