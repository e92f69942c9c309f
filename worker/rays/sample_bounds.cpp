#include <algorithm>
#include <limits>

#include "worker/rays/project.h"

namespace slabstream {

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
  bounds.most = *std::max_element(bounds.blocks.begin(), bounds.blocks.end());
  return bounds;
}

}  // namespace slabstream
