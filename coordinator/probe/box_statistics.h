// Statistics of the values that a box of a volume holds: of all its voxels, and of those of each label.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/view/clip.h"
#include "common/volume/bricks.h"
#include "common/volume/layers.h"
#include "common/volume/volume.h"

namespace slabstream {

struct BoxStatistics {
  std::uint64_t voxels = 0;      // finite ones whose centres lie in the box or on its sides
  std::uint64_t non_finite = 0;  // the others there
  // The mean of the data values of `voxels`; 0 if there are none.
  double mean = 0;
  double deviation = 0;  // standard deviation: the root of the mean squared difference from the mean
  double least = 0, largest = 0;
  friend bool operator==(const BoxStatistics&, const BoxStatistics&) = default;
};

struct LabelStatistics {
  Label label;
  BoxStatistics statistics;
  friend bool operator==(const LabelStatistics&, const LabelStatistics&) = default;
};

// Whole numbers that stored samples round, of all voxels of a volume, x fastest.
struct WholeNumbers {
  std::variant<std::span<const std::int32_t>, std::span<const std::uint32_t>, std::span<const std::int64_t>, std::span<const std::uint64_t>>
      samples;
  ValueMapping mapping = {};  // from these samples to data values
};

struct MeasuredVolume {
  VoxelBricks voxels;  // all voxels of the volume
  const VolumeDescription& description;
  std::optional<WholeNumbers> exact = {};  // in place of `voxels`
};

// Means of whole numbers are right to one rounding. InvalidArgument: the box cannot be laid into this volume. Pure; takes about a
// nanosecond a voxel.
Result<BoxStatistics> StatisticsIn(const MeasuredVolume& volume, const ClipBox& box);
// The same of the voxels of each label: those of the label with number i are at i - 1. `labels`: numbers up to `label_count`, on the
// volume's grid.
Result<std::vector<BoxStatistics>> StatisticsByLabel(const MeasuredVolume& volume, const ClipBox& box, const BrickedVoxels& labels,
                                                     std::size_t label_count);

}  // namespace slabstream
