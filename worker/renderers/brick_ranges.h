// BrickRanges: least and greatest stored sample of each brick of a slab. With it, bricks that a transfer function does not show are skipped
// without reading voxels. Bricks are kBrick voxels a side, at global multiples of kBrick, clipped to the slab.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/bricks.h"

namespace slabstream {

class BrickRanges {
 public:
  explicit BrickRanges(const VoxelBricks& voxels);

  struct Range {
    float min, max;  // of finite samples; min > max: there is none
  };
  // Of the brick that holds a voxel.
  const Range& At(std::int32_t x, std::int32_t y, std::int32_t z) const { return Of({x / kBrick, y / kBrick, z / kBrick}); }
  const Range& Of(const Index3& brick) const { return ranges_[grid_.Number(brick)]; }
  std::size_t bytes() const { return ranges_.capacity() * sizeof(Range); }

 private:
  BrickGrid grid_;
  std::vector<Range> ranges_;
};

}  // namespace slabstream
