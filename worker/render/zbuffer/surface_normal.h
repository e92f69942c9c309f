// The gradient of the data at a point of a voxel's cell: smoothed central differences (docs/rendering.md; over physical spacing, one-sided
// at the border) at the voxel and its 26 neighbours, blended by quadratic B-splines. Along a stair of cells the points that rays hit jump
// by up to a voxel; interpolation alone would show each step as a streak, the B-spline's smoothing does not, and it has no seam between
// cells at any magnification.
#pragma once

#include "common/volume/volume.h"

namespace slabstream {

// `point` lies in the cell of `voxel`, [voxel - 0.5, voxel + 0.5]. Reads voxels up to two away, cut to `voxels`. Exactly 0 where all of
// them are equal; not finite where a sample is not.
Vec3 GradientAt(const VoxelBlock& voxels, const Vec3& spacing, const Index3& voxel, const Vec3& point);

}  // namespace slabstream
