// Statistics of the values that a box of a volume holds: of all its voxels, and of those of each label.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "common/stats/probe_results.h"
#include "common/view/clip.h"
#include "common/volume/bricks.h"
#include "common/volume/layers.h"
#include "common/volume/volume.h"

namespace slabstream {

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
