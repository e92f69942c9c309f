// BrickRanges: least and greatest stored sample of each brick of a slab, so that a transfer function skips what it does not show without
// reading voxels. Bricks are kBrick voxels a side, at global multiples of kBrick, cut off by the slab.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/volume.h"

namespace slabstream {

class BrickRanges {
 public:
  static constexpr std::int32_t kBrick = 16;

  explicit BrickRanges(const VoxelBlock& voxels);

  struct Range {
    float min, max;  // of finite samples; min > max: there is none
  };
  // Of the brick that holds a voxel.
  const Range& At(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return ranges_[(std::size_t(z / kBrick - first_.z) * counts_.y + (y / kBrick - first_.y)) * counts_.x + (x / kBrick - first_.x)];
  }
  std::size_t bytes() const { return ranges_.capacity() * sizeof(Range); }

 private:
  Index3 first_, counts_;  // bricks
  std::vector<Range> ranges_;
};

}  // namespace slabstream
