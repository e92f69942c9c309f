// The width of voxels that supersampled pictures resolve (camera.h).
#pragma once

#include "common/volume/volume.h"

namespace slabstream {

// The least spacing. Where voxels are more than kMaxStretch times as long as wide, that would take far more pixels than the volume has
// voxels, so it is 1 / kMaxStretch of their mean width along the volume's diagonal, but never so wide that the volume's thinnest side has
// less than two pixels.
inline constexpr double kMaxStretch = 4;
double SupersampledVoxel(const VolumeGeometry& geometry);

}  // namespace slabstream
