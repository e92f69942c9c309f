#include "common/planning/clipped_cells.h"

namespace slabstream {

void EmptyClippedCells(const ClipRegion& clip, OccupancyGrid& grid) {
  if (clip.empty()) return;
  const Index3 cells = OccupancyCells(grid.size);
  for (std::size_t i = 0; i < grid.cells.size(); ++i) {
    if (grid.cells[i].voxels != 0 && !clip.MayKeep(OccupancyCellBox(PlaceIn(cells, i), grid.size))) grid.cells[i] = {};
  }
}

}  // namespace slabstream
