// The cull stage of splatting: drops the voxels of a batch whose whole footprint lies on saturated pixels, so that they are neither shaded
// nor splatted.
//
// Blocks and pieces are culled before the transform, by their bounds; that keeps what shares a block with something visible. This stage
// looks at each voxel alone, by one look-up.
#pragma once

#include <cstdint>

#include "worker/kernels/voxel_batch.h"

namespace slabstream {

// Which footprints are hidden, by the tile of the sheet in which their first tap lies: 1 if all tiles that the largest footprint reaches
// from there, to the right and downwards, are saturated. Not owned.
struct HiddenTiles {
  const std::uint8_t* hidden = nullptr;
  std::int32_t tiles_x = 0, tiles_y = 0;
};

// Closes up the transformed arrays of `batch` over the voxels that are dropped; counts of pieces and the batch shrink.
// First taps to the left of the sheet or above it count as in its first tile, whose reach includes theirs.
void CullHiddenVoxels(const HiddenTiles& tiles, VoxelBatch& batch);

}  // namespace slabstream
