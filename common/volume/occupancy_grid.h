// OccupancyGrid: how many voxels of each cell of a volume are occupied, that is visible under one transfer function.
//
// Cells are cubes of kOccupancyCell voxels a side at multiples of it, the last ones cut off by the volume's border.
#pragma once

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

struct OccupancyGrid {
  Index3 size;                          // voxels of the volume
  std::vector<std::uint16_t> occupied;  // by cell, x fastest: [0, kOccupancyCell^3]
  friend bool operator==(const OccupancyGrid&, const OccupancyGrid&) = default;
};

}  // namespace slabstream
