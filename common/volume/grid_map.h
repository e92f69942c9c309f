// GridMap: from positions among the voxels of one grid to positions among those of another one, of the same part of the world with parallel
// axes. Levels of a volume are such grids.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/volume/volume.h"

namespace slabstream {

// p of the one grid, in data space, lies at scale * p + offset of the other one, by axis.
struct GridMap {
  Vec3 scale = {1, 1, 1}, offset;

  double To(double position, Axis axis) const { return scale[axis] * position + offset[axis]; }
  double From(double position, Axis axis) const { return (position - offset[axis]) / scale[axis]; }
  friend bool operator==(const GridMap&, const GridMap&) = default;
};

inline GridMap MapBetween(const VolumeGeometry& from, const VolumeGeometry& to) {
  if (from == to) return {};
  const auto origin = [](const VolumeGeometry& grid) { return grid.orientation.FromWorld(grid.orientation.origin); };
  return {from.spacing / to.spacing, (origin(from) - origin(to)) / to.spacing};
}

// Whether `level` has samples for every position in a volume of `grid`: the voxels at its border are at most half a voxel away from where
// the volume ends. Its axes are those of the grid.
inline bool CanStandIn(const VolumeGeometry& level, const VolumeGeometry& grid) {
  constexpr double kMargin = 1.0 / 64;  // voxels: covers the rounding of positions
  const GridMap map = MapBetween(grid, level);
  for (const Axis axis : kAxes) {
    const double low = map.To(-0.5, axis), high = map.To(grid.size[axis] - 0.5, axis);
    if (!(low >= -1 + kMargin && high <= level.size[axis] - kMargin)) return false;
  }
  return level.orientation.axes == grid.orientation.axes;
}

// The voxels of the other grid that cover `box`, not empty, of the one, as far as that grid reaches; at least one voxel.
inline Box CoveringVoxels(const Box& box, const GridMap& map, const Index3& size) {
  constexpr double kSame = 1e-4;  // voxels: what rounding moves
  Box voxels;
  for (const Axis axis : kAxes) {
    const double low = map.To(box.begin[axis] - 0.5, axis), high = map.To(box.end[axis] - 0.5, axis);
    const double first = std::clamp(std::floor(low + 0.5 + kSame), 0.0, size[axis] - 1.0);
    voxels.begin[axis] = std::int32_t(first);
    voxels.end[axis] = std::int32_t(std::clamp(std::ceil(high + 0.5 - kSame), first + 1, double(size[axis])));
  }
  return voxels;
}

}  // namespace slabstream
