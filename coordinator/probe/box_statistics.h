// Statistics of the values that a box of a volume holds.
#pragma once

#include <cstdint>

#include "common/base/status.h"
#include "common/view/clip.h"
#include "common/volume/bricks.h"
#include "common/volume/volume.h"

namespace slabstream {

struct BoxStatistics {
  std::uint64_t voxels = 0;      // finite ones whose centres lie in the box or on its sides
  std::uint64_t non_finite = 0;  // the others there
  // Of the data values of `voxels`; 0 if there are none.
  double mean = 0;
  double deviation = 0;  // standard deviation: the root of the mean squared difference from the mean
  double least = 0, largest = 0;
  friend bool operator==(const BoxStatistics&, const BoxStatistics&) = default;
};

// `voxels` are those of the whole volume. InvalidArgument: the box cannot be laid into this volume. Pure; takes about a nanosecond a voxel.
Result<BoxStatistics> StatisticsIn(const VoxelBricks& voxels, const VolumeDescription& volume, const ClipBox& box);

}  // namespace slabstream
