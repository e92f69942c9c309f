#include <algorithm>
#include <limits>

#include "worker/renderers/mip/project.h"

namespace slabstream {

SampleBounds BoundSamples(const CellRanges& cells, float sign) {
  constexpr int kCellsABlock = kBlockShift - kCellShift;  // log2
  const Index3& counts = cells.grid.counts;
  SampleBounds bounds;
  bounds.cells.reserve(cells.ranges.size());
  for (int axis = 0; axis < 3; ++axis) bounds.block_counts[axis] = ((counts[axis] - 1) >> kCellsABlock) + 1;
  const CellGrid blocks{bounds.block_counts};
  bounds.blocks.assign(blocks.size(), std::numeric_limits<float>::lowest());
  for (Index3 cell; cell.z < counts.z; ++cell.z) {
    for (cell.y = 0; cell.y < counts.y; ++cell.y) {
      for (cell.x = 0; cell.x < counts.x; ++cell.x) {
        const CellRange& range = cells.ranges[cells.grid.Number(cell)];
        const float bound = range.min > range.max ? std::numeric_limits<float>::lowest() : sign > 0 ? range.max : -range.min;
        bounds.cells.push_back(bound);
        float& block = bounds.blocks[blocks.Number({cell.x >> kCellsABlock, cell.y >> kCellsABlock, cell.z >> kCellsABlock})];
        block = std::max(block, bound);
      }
    }
  }
  bounds.most = *std::max_element(bounds.blocks.begin(), bounds.blocks.end());
  return bounds;
}

}  // namespace slabstream
