#include "common/view/clip_corners.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace slabstream {

std::vector<Vec3> CornersOf(const ClipRegion& region, const Box& box) {
  std::vector<HalfSpace> sides;
  for (const Axis axis : kAxes) {
    Vec3 normal;
    normal[axis] = 1;
    sides.push_back({normal, 0.5 - box.begin[axis]});
    sides.push_back({-normal, box.end[axis] - 0.5});
  }
  const Vec3 middle = 0.5 * (ToVec3(box.begin + box.end) - Vec3{1, 1, 1}), half = 0.5 * ToVec3(box.size());
  const auto cuts = [&](const HalfSpace& side) { return side.Distance(middle) < Dot(Absolute(side.normal), half); };
  std::ranges::copy_if(region.sides, std::back_inserter(sides), cuts);

  // Where three sides meet within all others.
  constexpr double kRounding = 1e-9;
  const auto within = [](const HalfSpace& side, const Vec3& p) {
    return side.Distance(p) >= -kRounding * (Dot(Absolute(side.normal), Absolute(p)) + std::abs(side.offset));
  };
  std::vector<Vec3> corners;
  for (auto a = sides.begin(); a != sides.end(); ++a) {
    for (auto b = a + 1; b != sides.end(); ++b) {
      const Vec3 line = Cross(a->normal, b->normal);
      for (auto c = b + 1; c != sides.end(); ++c) {
        const double volume = Dot(line, c->normal);
        if (std::abs(volume) <= kRounding * Length(a->normal) * Length(b->normal) * Length(c->normal)) continue;
        const Vec3 meet = a->offset * Cross(b->normal, c->normal) + b->offset * Cross(c->normal, a->normal) + c->offset * line;
        const Vec3 p = (-1 / volume) * meet;
        if (std::ranges::all_of(sides, [&](const HalfSpace& side) { return within(side, p); })) corners.push_back(p);
      }
    }
  }
  return corners;
}

}  // namespace slabstream
