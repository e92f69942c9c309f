#include <algorithm>
#include <limits>

#include "worker/rays/project.h"

namespace slabstream {
namespace {

// The bounds of windows. At the end of a row, a window goes on with the next row: its bound is too large there, never too small.
std::vector<float> WindowsOf(std::vector<float> bounds, const Index3& counts) {
  for (const std::size_t stride : {std::size_t(1), std::size_t(counts.x), std::size_t(counts.x) * std::size_t(counts.y)}) {
    for (int step = 0; step < kWindowStep; ++step) {
      for (std::size_t i = stride; i < bounds.size(); ++i) bounds[i - stride] = std::max(bounds[i - stride], bounds[i]);
    }
  }
  return bounds;
}

}  // namespace

SampleBounds BoundSamples(const MacrocellRanges& cells, float sign) {
  constexpr int kCellsABlock = kBlockShift - kCellShift;  // log2
  const Index3& counts = cells.counts;
  SampleBounds bounds;
  bounds.cells.reserve(cells.ranges.size());
  bounds.block_counts = CubesOver(counts, 1 << kCellsABlock);
  bounds.blocks.assign(CountIn(bounds.block_counts), std::numeric_limits<float>::lowest());
  for (Index3 cell; cell.z < counts.z; ++cell.z) {
    for (cell.y = 0; cell.y < counts.y; ++cell.y) {
      for (cell.x = 0; cell.x < counts.x; ++cell.x) {
        const MacrocellRange& range = cells.ranges[NumberIn(counts, cell)];
        const float bound = range.min > range.max ? std::numeric_limits<float>::lowest() : sign > 0 ? range.max : -range.min;
        bounds.cells.push_back(bound);
        float& block = bounds.blocks[NumberIn(bounds.block_counts, cell / (1 << kCellsABlock))];
        block = std::max(block, bound);
      }
    }
  }
  bounds.cell_windows = WindowsOf(bounds.cells, counts);
  bounds.block_windows = WindowsOf(bounds.blocks, bounds.block_counts);
  bounds.most = *std::max_element(bounds.blocks.begin(), bounds.blocks.end());
  return bounds;
}

}  // namespace slabstream
