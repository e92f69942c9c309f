// Layers on the grid of their volume: a volume elsewhere in the same world, on any grid, is sampled at the voxels of
// another.
//
//   position   of a voxel of the grid in the data space of the layer, through world space (common/volume/orientation.h). Less than 1e-6
//              voxel lengths from a voxel's centre it is that centre, so that a layer on the same grid keeps its samples to the last bit
//   inside     the layer fills [-0.5, size - 0.5) of its data space
//
// Parallel. Memory is that of the result; whoever calls has checked that it fits.
#pragma once

#include "common/volume/volume.h"

namespace slabstream {

// The numbers, uint16, of the voxels nearest to those of `grid`, as `type`, kUint8 or kUint16, which holds them; 0
// outside. If two voxels are equally near, the one with the higher index counts.
VoxelBlock NearestOn(const VolumeGeometry& grid, const VolumeGeometry& layer, const VoxelBlock& numbers, ScalarType type);

}  // namespace slabstream
