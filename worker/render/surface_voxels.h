// SurfaceVoxels: the voxels that the Z-buffer draws: opaque ones of a box that are not enclosed by six opaque neighbours.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/volume.h"
#include "worker/render/bin_lookup.h"
#include "worker/render/brick_ranges.h"

namespace slabstream {

struct SurfaceVoxel {
  std::uint16_t x = 0, y = 0, z = 0;  // of the volume
  std::uint8_t open_faces = 0;  // bit 2 * axis: the face towards lower indices has no opaque neighbour; bit 2 * axis + 1: the higher one
};

// In memory order. Neighbours are looked up in all of `voxels`, the halo included; outside the volume there is none.
std::vector<SurfaceVoxel> FindSurfaceVoxels(const VoxelBlock& voxels, const BrickRanges& bricks, const ClassificationTable& table,
                                            const BinSelection& opaque, const Box& box);

}  // namespace slabstream
