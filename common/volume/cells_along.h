// CellsAlong: the cells of an OccupancyGrid that a box touches along one axis, and how much of each lies inside. VisitCells: those that it
// touches at all.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/volume/occupancy_grid.h"

namespace slabstream {

class CellsAlong {
 public:
  // `box` is not empty.
  CellsAlong(const Box& box, Axis axis)
      : begin(box.begin[axis] / kOccupancyCell),
        end((box.end[axis] - 1) / kOccupancyCell + 1),
        first_voxel_(box.begin[axis]),
        end_voxel_(box.end[axis]) {}

  const std::int32_t begin, end;  // cells

  // The range of a cell's voxels that lies inside the box, counted from the cell's first one.
  std::int32_t FirstInside(std::int32_t cell) const { return std::max(first_voxel_ - cell * kOccupancyCell, 0); }
  std::int32_t EndInside(std::int32_t cell) const { return std::min(end_voxel_ - cell * kOccupancyCell, kOccupancyCell); }
  // As a share of kOccupancyCell.
  double ShareInside(std::int32_t cell) const { return double(EndInside(cell) - FirstInside(cell)) / kOccupancyCell; }

 private:
  const std::int32_t first_voxel_, end_voxel_;
};

// Calls function(place of the cell, its share inside) for each cell that `box`, not empty, touches; x fastest. Shares are of
// kOccupancyCell^3 voxels.
template <class Function>
void VisitCells(const Box& box, Function&& function) {
  const CellsAlong x(box, Axis::kX), y(box, Axis::kY), z(box, Axis::kZ);
  Index3 cell;
  for (cell.z = z.begin; cell.z < z.end; ++cell.z) {
    for (cell.y = y.begin; cell.y < y.end; ++cell.y) {
      for (cell.x = x.begin; cell.x < x.end; ++cell.x) {
        function(cell, x.ShareInside(cell.x) * y.ShareInside(cell.y) * z.ShareInside(cell.z));
      }
    }
  }
}

}  // namespace slabstream
