// AffineMap: from positions among the voxels of one grid to positions among those of another one, which may be turned against it. Both lie
// in the same world.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/volume/volume.h"

namespace slabstream {

// p of the one grid, in data space, lies at offset + p.x * steps[0] + p.y * steps[1] + p.z * steps[2] of the other one.
struct AffineMap {
  std::array<Vec3, 3> steps = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 offset;

  Vec3 To(const Vec3& p) const { return offset + p.x * steps[0] + p.y * steps[1] + p.z * steps[2]; }
  // The least and the greatest coordinates of what positions from `low` to `high` become.
  std::pair<Vec3, Vec3> Bounds(const Vec3& low, const Vec3& high) const {
    Vec3 least = offset, most = offset;
    for (const Axis from : kAxes) {
      const Vec3& step = steps.at(std::size_t(Number(from)));
      for (const Axis axis : kAxes) {
        const double a = step[axis] * low[from], b = step[axis] * high[from];
        least[axis] += std::min(a, b);
        most[axis] += std::max(a, b);
      }
    }
    return {least, most};
  }
  bool is_identity() const { return *this == AffineMap(); }
  friend bool operator==(const AffineMap&, const AffineMap&) = default;
};

// Numbers that differ from whole ones by rounding alone become whole, so that grids that are the same in the world keep samples to the last
// bit.
inline AffineMap AffineMapBetween(const VolumeGeometry& from, const VolumeGeometry& to) {
  constexpr double kSame = 1e-9, kSameOffset = 1e-6;  // voxels
  const auto among = [&](const Vec3& world) { return to.orientation.FromWorld(world) / to.spacing; };
  const auto snapped = [](Vec3 v, double same) {
    for (const Axis axis : kAxes) {
      if (std::abs(v[axis] - std::round(v[axis])) < same) v[axis] = std::round(v[axis]);
    }
    return v;
  };
  AffineMap map;
  map.offset = snapped(among(from.orientation.origin - to.orientation.origin), kSameOffset);
  for (const Axis axis : kAxes) {
    map.steps.at(std::size_t(Number(axis))) =
        snapped(among(from.spacing[axis] * from.orientation.axes.at(std::size_t(Number(axis)))), kSame);
  }
  return map;
}

// The voxels of the other grid, of `size`, that positions in `box` of the one can lie in, and so many more on each side; empty: there are
// none.
inline Box CoveringVoxels(const Box& box, const AffineMap& map, const Index3& size, std::int32_t more) {
  constexpr double kSame = 1e-4;  // voxels: what rounding moves
  const Vec3 half = {0.5, 0.5, 0.5};
  const auto [low, high] = map.Bounds(ToVec3(box.begin) - half, ToVec3(box.end) - half);
  Box voxels;
  for (const Axis axis : kAxes) {
    const double least = low[axis], most = high[axis];
    // The grid fills [-0.5, size - 0.5).
    if (most < -0.5 || least > size[axis] - 0.5) return {};
    const double first = std::floor(least + 0.5 + kSame) - more, end = std::ceil(most + 0.5 - kSame) + more;
    voxels.begin[axis] = std::int32_t(std::clamp(first, 0.0, size[axis] - 1.0));
    voxels.end[axis] = std::int32_t(std::clamp(end, voxels.begin[axis] + 1.0, double(size[axis])));
  }
  return voxels;
}

}  // namespace slabstream
