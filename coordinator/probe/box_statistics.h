// Statistics of the values that a box of a volume holds: of all its voxels, and of those of each label.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <variant>

#include "common/base/status.h"
#include "common/stats/probe_results.h"
#include "common/view/clip.h"
#include "common/volume/bricks.h"
#include "common/volume/labels.h"
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
// The labels of a row of the volume's voxels, from `first` along x on, all in one brick; 0: none.
using ReadLabels = std::function<void(const Index3& first, std::span<std::uint64_t> labels)>;
// The same of the voxels of each label, by label. ResourceExhausted: more than kMaxLabels labels have voxels in the box.
Result<std::map<std::uint64_t, BoxStatistics>> StatisticsByLabel(const MeasuredVolume& volume, const ClipBox& box,
                                                                 const ReadLabels& labels);

}  // namespace slabstream
