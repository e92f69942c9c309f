// Layers of cells of an OccupancyGrid while voxels are counted: a bit for each voxel.
#pragma once

#include <cstdint>

#include "common/volume/occupancy_grid.h"

namespace slabstream {

// The voxels of a cell with one z: bit kOccupancyCell * y + x.
using OccupancyLayer = std::uint64_t;

// The rows of a layer that hold any, bit y.
constexpr std::uint32_t RowsOf(OccupancyLayer layer) {
  constexpr OccupancyLayer kLow = 0x7F7F7F7F7F7F7F7F;
  const OccupancyLayer any = (((layer & kLow) + kLow) | layer) & ~kLow;  // the highest bit of each row
  return std::uint32_t((any >> 7) * 0x0102040810204080 >> 56);
}

// The columns of a layer that hold any, bit x.
constexpr std::uint32_t ColumnsOf(OccupancyLayer layer) {
  layer |= layer >> 32;
  layer |= layer >> 16;
  layer |= layer >> 8;
  return std::uint32_t(layer & 0xFF);
}

// Counts layer z, in [0, kOccupancyCell), into its cell.
constexpr void AddLayer(CellOccupancy& cell, std::int32_t z, OccupancyLayer layer) {
  if (layer == 0) return;
  const std::int32_t first_line = kOccupancyCell * z;
  cell.lines_x |= LineSet{RowsOf(layer)} << first_line;
  cell.lines_y |= LineSet{ColumnsOf(layer)} << first_line;
  cell.voxels = std::uint16_t(cell.voxels + CountOf(layer));
}

}  // namespace slabstream
