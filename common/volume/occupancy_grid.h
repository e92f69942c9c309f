// OccupancyGrid: how many voxels of each cell of a volume are occupied, that is, drawn under one transfer function, and on which lines.
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
constexpr Index3 OccupancyCells(const Index3& size) { return CubesOver(size, kOccupancyCell); }

// The voxels of a cell.
constexpr Box OccupancyCellBox(const Index3& cell, const Index3& size) {
  return Intersection({kOccupancyCell * cell, kOccupancyCell * (cell + Uniform(1))}, {{0, 0, 0}, size});
}

// The share of cell number `cell` along an axis that lies in `box`.
constexpr double CellShare(const Box& box, Axis axis, std::int32_t cell, const Index3& size) {
  const std::int32_t begin = cell * kOccupancyCell, end = std::min(begin + kOccupancyCell, size[axis]);
  return double(std::max(std::min(box.end[axis], end) - std::max(box.begin[axis], begin), 0)) / (end - begin);
}

// A bit for each line of a cell that runs along x, or for each that runs along y. Bit kOccupancyCell * z + i is the line at height z and at
// y = i, or at x = i. Both are counted from the cell's first voxel.
using LineSet = std::uint64_t;
static_assert(kOccupancyCell * kOccupancyCell == 64, "a bit for each line");

// The lines at [z_begin, z_end) and [begin, end) along the other axis: 0 <= begin <= end <= kOccupancyCell.
constexpr LineSet LinesIn(std::int32_t z_begin, std::int32_t z_end, std::int32_t begin, std::int32_t end) {
  const auto below = [](std::int32_t bit) { return bit == 64 ? ~LineSet{0} : (LineSet{1} << bit) - 1; };
  constexpr LineSet kFirstOfEachLayer = 0x0101010101010101;
  const LineSet layers = below(kOccupancyCell * z_end) & ~below(kOccupancyCell * z_begin);
  return layers & kFirstOfEachLayer * (below(end) & ~below(begin));
}

// How many lines a set holds: one byte for each z. The basic x86-64 instruction set has no instruction for it, and the library's function
// costs a call (Warren, "Hacker's Delight", 2002, section 5-1).
constexpr LineSet CountsByLayer(LineSet lines) {
  lines -= lines >> 1 & 0x5555555555555555;
  lines = (lines & 0x3333333333333333) + (lines >> 2 & 0x3333333333333333);
  return (lines + (lines >> 4)) & 0x0F0F0F0F0F0F0F0F;
}
constexpr int CountOf(LineSet lines) { return int(CountsByLayer(lines) * 0x0101010101010101 >> 56); }

struct CellOccupancy {
  LineSet lines_x = 0, lines_y = 0;  // lines along x (bits by z and y) and along y (by z and x) with any occupied voxel
  std::uint16_t voxels = 0;          // occupied: [0, kOccupancyCell^3]
  friend bool operator==(const CellOccupancy&, const CellOccupancy&) = default;
};

// The occupancy of a cell with these voxels if all of them are occupied.
constexpr CellOccupancy FullCell(const Box& cell) {
  const Index3 size = cell.size();
  return {LinesIn(0, size.z, 0, size.y), LinesIn(0, size.z, 0, size.x), std::uint16_t(cell.voxel_count())};
}

struct OccupancyGrid {
  Index3 size;                       // voxels of the volume
  std::vector<CellOccupancy> cells;  // x fastest
  friend bool operator==(const OccupancyGrid&, const OccupancyGrid&) = default;
};

}  // namespace slabstream
