// OccupancyGrid: how many voxels of each cell of a volume are occupied, that is drawn under one transfer function, and how they lie.
//
// Cells are cubes of kOccupancyCell voxels a side at multiples of it, the last ones cut off by the volume's border.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

inline constexpr std::int32_t kOccupancyCell = 8;  // voxels

// Cells along each axis of a volume of `size` voxels.
constexpr Index3 OccupancyCells(const Index3& size) {
  const auto cells = [](std::int32_t voxels) { return (voxels + kOccupancyCell - 1) / kOccupancyCell; };
  return {cells(size.x), cells(size.y), cells(size.z)};
}

// The voxels of a cell.
constexpr Box OccupancyCellBox(const Index3& cell, const Index3& size) {
  const auto voxel = [](const Index3& c) { return Index3{c.x * kOccupancyCell, c.y * kOccupancyCell, c.z * kOccupancyCell}; };
  return Intersection({voxel(cell), voxel({cell.x + 1, cell.y + 1, cell.z + 1})}, {{0, 0, 0}, size});
}

// Of the cells' extent number `cell` along an axis, the share that lies in `box`.
constexpr double CellShare(const Box& box, Axis axis, std::int32_t cell, const Index3& size) {
  const std::int32_t begin = cell * kOccupancyCell, end = std::min(begin + kOccupancyCell, size[axis]);
  return double(std::max(std::min(box.end[axis], end) - std::max(box.begin[axis], begin), 0)) / (end - begin);
}

struct CellOccupancy {
  std::uint16_t voxels = 0;             // occupied: [0, kOccupancyCell^3]
  std::uint8_t rows_x = 0, rows_y = 0;  // of the cell's rows along x and along y, those that hold any: [0, kOccupancyCell^2]
  friend bool operator==(const CellOccupancy&, const CellOccupancy&) = default;
};

// Of a cell of these voxels, all of which are occupied.
constexpr CellOccupancy FullCell(const Box& cell) {
  const Index3 size = cell.size();
  return {std::uint16_t(cell.voxel_count()), std::uint8_t(size.y * size.z), std::uint8_t(size.x * size.z)};
}

struct OccupancyGrid {
  Index3 size;                       // voxels of the volume
  std::vector<CellOccupancy> cells;  // x fastest
  friend bool operator==(const OccupancyGrid&, const OccupancyGrid&) = default;
};

}  // namespace slabstream
