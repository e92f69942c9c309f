// VoxelLattice: every step-th voxel of a volume along each axis, in the middle of it. It is what a coarser level of an owned volume shows:
// nobody has to make such a level, and little is read for it.
#pragma once

#include <cstdint>

#include "common/volume/box.h"
#include "common/volume/volume.h"

namespace slabstream {

// How many there are of every 2^level-th of so many voxels along each axis, from the first one on.
inline Index3 PointsAlong(const Index3& voxels, int level) { return (voxels - Uniform(1)) / Uniform(1 << level) + Uniform(1); }

struct VoxelLattice {
  Index3 first;            // the voxel of the first point
  Index3 size;             // points along each axis
  std::int32_t level = 0;  // points are 2^level voxels apart

  static VoxelLattice Of(const Index3& volume, int level) {
    const Index3 size = PointsAlong(volume, level);
    const Index3 rest = volume - Uniform(1) - (size - Uniform(1)) * Uniform(1 << level);
    return {rest / Uniform(2), size, level};
  }

  Index3 step() const { return Uniform(1 << level); }
  // The points that lie among these voxels; perhaps none.
  Box PointsIn(const Box& voxels) const {
    const auto first_from = [this](const Index3& voxel) { return (voxel - first + step() - Uniform(1)) / step(); };
    return {first_from(voxels.begin), first_from(voxels.end)};
  }
  // The voxels from the first to the last one of some points.
  Box VoxelsOf(const Box& points) const { return {first + points.begin * step(), first + (points.end - Uniform(1)) * step() + Uniform(1)}; }

  // An even grid of voxels, with the points instead.
  VolumeGeometry In(VolumeGeometry voxels) const {
    voxels.orientation.origin = voxels.ToWorld(ToVec3(first));
    voxels.spacing = double(1 << level) * voxels.spacing;
    voxels.size = size;
    return voxels;
  }
};

}  // namespace slabstream
