// The light volume: a coarse version of a volume, from which shadows and ambient occlusion are made (docs/rendering.md). It depends on the
// volume alone, so it is the same for every view, transfer function, partition and worker.
#pragma once

#include "common/volume/bricks.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr std::int32_t kMaxLightSide = 128;  // voxels along an axis

// Whether the volume is coarse enough to be its own light volume.
inline bool IsLightSized(const VolumeGeometry& geometry) {
  return std::max({geometry.size.x, geometry.size.y, geometry.size.z}) <= kMaxLightSide;
}

// A voxel of the light volume is a block of voxels: along each axis as few as make at most kMaxLightSide blocks. The last blocks may reach
// beyond the volume. Centres of voxels are those of blocks.
VolumeGeometry LightGeometry(const VolumeGeometry& geometry);

// Same type and mapping, each voxel the mean of the finite samples of its block, rounded to the type; NaN: the block has none.
// `voxels`: all of the volume. Reads every voxel once. Parallel; the result is the same for any number of threads.
Volume MakeLightVolume(const VoxelBlock& voxels, const VolumeDescription& description);
Volume MakeLightVolume(const BrickedVoxels& voxels, const VolumeDescription& description);

}  // namespace slabstream
