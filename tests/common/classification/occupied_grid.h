// The grid of given voxels, counted one by one.
#pragma once

#include <vector>

#include "common/volume/occupancy_grid.h"

namespace slabstream {

// `occupied`: of each voxel, x fastest.
inline OccupancyGrid GridOf(const Index3& size, const std::vector<bool>& occupied) {
  OccupancyGrid grid{size, std::vector<CellOccupancy>(CountIn(OccupancyCells(size)))};
  for (std::size_t i = 0; i < occupied.size(); ++i) {
    if (!occupied[i]) continue;
    const Index3 v = PlaceIn(size, i);
    CellOccupancy& cell = grid.cells[NumberIn(OccupancyCells(size), v / kOccupancyCell)];
    ++cell.voxels;
    cell.lines_x |= LineSet{1} << (8 * (v.z % 8) + v.y % 8);
    cell.lines_y |= LineSet{1} << (8 * (v.z % 8) + v.x % 8);
  }
  return grid;
}

}  // namespace slabstream
