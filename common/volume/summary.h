// VolumeSummary: what the planner, the automatic transfer function and `info` know about a volume without its voxels.
//
// The volume is divided into bricks of kSummaryBrick voxels a side (the last ones cut off by the volume's border). Each brick keeps the
// range of data values of its voxels, so whether a box can hold anything visible under a transfer function is answered from bricks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/volume/volume.h"

namespace slabstream {

inline constexpr std::int32_t kSummaryBrick = 16;      // voxels
inline constexpr int kHistogramBins = 256;

struct ValueRange {
  float min = 0;
  float max = 0;
  friend bool operator==(const ValueRange&, const ValueRange&) = default;
};

struct VolumeSummary {
  VolumeDescription description;
  ValueRange range;                                            // of finite data values; {0, 0} if there is none
  std::array<std::uint64_t, kHistogramBins> histogram{};       // equal bins over `range`; the last bin includes range.max
  Index3 brick_counts;                                         // bricks along each axis
  std::vector<ValueRange> bricks;                              // x fastest; of finite values; min > max: none finite
  std::int64_t non_finite = 0;                                 // voxels that are NaN or infinite: never visible

  friend bool operator==(const VolumeSummary&, const VolumeSummary&) = default;
};

// Reads every voxel once.
VolumeSummary Summarize(const Volume& volume);

}  // namespace slabstream
