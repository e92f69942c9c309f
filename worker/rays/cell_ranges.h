// CellRanges: least and greatest sample of small cells, so that rays leap over cells that show nothing.
//
// A cell holds the sample positions p whose floor lies in a cube of kCellSide voxels, counted from box.begin - 1. Trilinear interpolation
// also reads the next voxel, so a cell's range is that of kCellSide + 1 voxels a side.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/rays/padded_voxels.h"

namespace slabstream {

inline constexpr int kCellShift = 2;
inline constexpr std::int32_t kCellSide = 1 << kCellShift;  // voxels

// Cells of the box of padded voxels, x fastest.
struct CellGrid {
  Index3 counts;

  std::size_t size() const { return std::size_t(counts.x) * std::size_t(counts.y) * std::size_t(counts.z); }
  std::size_t Number(const Index3& cell) const {
    return (std::size_t(cell.z) * std::size_t(counts.y) + std::size_t(cell.y)) * std::size_t(counts.x) + std::size_t(cell.x);
  }
};

struct CellRange {
  float min, max;  // stored samples, finite ones; min > max: there is none
};

struct CellRanges {
  CellGrid grid;
  std::vector<CellRange> ranges;

  std::size_t bytes() const { return ranges.capacity() * sizeof(CellRange); }
};

// Parallel.
CellRanges FindCellRanges(const PaddedVoxels& voxels);

}  // namespace slabstream
