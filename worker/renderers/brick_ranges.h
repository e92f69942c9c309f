// BrickRanges: least and greatest stored sample of each brick of a padded box. With it, bricks that a transfer function does not show are
// skipped without reading voxels.
#pragma once

#include <cstdint>
#include <vector>

#include "common/parallel/parallel.h"
#include "common/volume/bricks.h"

namespace slabstream {

// Calls function(first brick) for each row of bricks along x. Parallel.
template <class Function>
void ForEachRowOfBricks(const BrickGrid& grid, Function&& function) {
  ParallelFor(0, grid.counts.y * grid.counts.z, [&](std::int32_t row) {
    function(Index3{grid.first.x, grid.first.y + row % grid.counts.y, grid.first.z + row / grid.counts.y});
  });
}

class BrickRanges {
 public:
  explicit BrickRanges(const VoxelBricks& voxels);

  struct Range {
    float min, max;  // the range of finite samples; min > max: there is none
  };
  const Range& Of(const Index3& brick) const { return ranges_[grid_.Number(brick)]; }
  std::size_t bytes() const { return ranges_.capacity() * sizeof(Range); }

 private:
  BrickGrid grid_;
  std::vector<Range> ranges_;
};

}  // namespace slabstream
