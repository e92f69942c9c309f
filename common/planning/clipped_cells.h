// What clipping leaves of an occupancy grid.
#pragma once

#include "common/view/clip.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

// Empties the cells of which nothing is drawn. Cells that are clipped in part keep all their voxels.
void EmptyClippedCells(const ClipRegion& clip, OccupancyGrid& grid);

}  // namespace slabstream
