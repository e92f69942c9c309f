// Counting occupied voxels: one pass over a volume.
#pragma once

#include "common/classification/classification_table.h"
#include "common/volume/bricks.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

// Occupied: the voxel's bin has an opacity above zero, as the renderers see it; samples that are not finite never are. `voxels` are those
// of a whole volume, from voxel 0 on. Parallel, with the same result for any number of threads; bricks of one value cost next to nothing.
OccupancyGrid CountOccupied(const VoxelBricks& voxels, const ClassificationTable& table);

}  // namespace slabstream
