#include "client/pictures/picture_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

namespace slabstream {
namespace {

std::string LengthText(double length, LengthUnit unit) {
  std::string_view name = PluralOf(unit);
  if (length == 1 && unit <= LengthUnit::kFile) name.remove_suffix(1);  // one voxel, one unit
  return fmt::format("{:g} {}", length, name);
}

}  // namespace

std::optional<ScaleBar> ChooseScaleBar(const PictureGeometry& geometry, int width) {
  const double wanted = 0.2 * width * geometry.pixel_size;
  if (!std::isnormal(wanted)) return std::nullopt;
  const int exponent = int(std::floor(std::log10(wanted)));
  ScaleBar bar;
  double nearest = std::numeric_limits<double>::infinity();
  for (const int digit : {1, 2, 5, 10}) {
    // As a decimal: products of a power of ten would be off in the last digit.
    const double length = std::strtod(fmt::format("{}e{}", digit, exponent).c_str(), nullptr);
    const double ratio = std::abs(std::log(length / wanted));
    if (!(ratio < nearest)) continue;
    nearest = ratio;
    bar.length = length;
  }
  bar.pixels = bar.length / geometry.pixel_size;
  if (!std::isnormal(bar.length) || !(bar.pixels < width)) return std::nullopt;
  bar.label = LengthText(bar.length, geometry.unit);
  if (geometry.projection == Projection::kPerspective) bar.label += " at target";
  return bar;
}

std::string PatientSides(const Vec3& direction) {
  static const double kLeast = std::sin(10 * std::numbers::pi / 180);
  constexpr double kTie = 1e-9;  // keeps rounding noise from choosing between sides that are equally near
  constexpr std::array<std::array<char, 2>, 3> kSides = {{{'L', 'R'}, {'P', 'A'}, {'I', 'S'}}};  // towards -, +
  std::array<Axis, 3> axes = kAxes;
  std::ranges::stable_sort(axes, [&](Axis a, Axis b) { return std::abs(direction[a]) > std::abs(direction[b]) + kTie; });
  std::string sides;
  for (const Axis axis : axes) {
    if (std::abs(direction[axis]) > kLeast) sides += kSides[std::size_t(Number(axis))][direction[axis] > 0 ? 1 : 0];
  }
  return sides;
}

std::array<ShownAxis, 3> ShownAxes(const PictureGeometry& geometry) {
  constexpr std::array<std::array<std::string_view, 2>, 3> kLabels = {{{"x", "R"}, {"y", "A"}, {"z", "S"}}};
  std::array<ShownAxis, 3> shown;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    shown[i] = {axis, kLabels[i][geometry.world == World::kPatient ? 1 : 0], geometry.right[axis], -geometry.up[axis],
                geometry.forward[axis]};
  }
  std::ranges::stable_sort(shown, [](const ShownAxis& a, const ShownAxis& b) { return a.depth > b.depth; });
  return shown;
}

std::vector<double> TicksOf(double low, double high, int most) {
  constexpr int kLeast = 3, kFew = 8;  // of two steps in a row, the finer one makes at most 8 ticks if the coarser one makes less than 3
  std::vector<double> finer;
  const double range = high - low;
  if (!std::isnormal(range)) return {low};
  for (int exponent = int(std::floor(std::log10(range))) - 1;; ++exponent) {
    for (const int digit : {1, 2, 5}) {
      // 10^-n is not exact, but the quotient by 10^n is rounded once.
      const double power = std::pow(10, std::abs(exponent));
      const auto tick = [&](double n) { return exponent < 0 ? n * digit / power : n * digit * power; };
      const double first = std::ceil(low / tick(1) - 1e-9), last = std::floor(high / tick(1) + 1e-9);
      if (last - first + 1 > kFew) continue;
      std::vector<double> ticks;
      for (double n = first; n <= last; ++n) ticks.push_back(std::clamp(tick(n), low, high) + 0.0);
      if (int(ticks.size()) < kLeast && !finer.empty()) return finer;
      if (int(ticks.size()) <= most) return ticks;
      finer = std::move(ticks);
    }
  }
}

}  // namespace slabstream
