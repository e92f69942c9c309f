// JointHistogram: how often which value occurs together with which slope (the gradient's magnitude), for the editor of two-dimensional
// transfer functions (Kindlmann and Durkin 1998).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/status.h"
#include "common/volume/bricks.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr int kJointValues = 128, kJointSlopes = 64;

struct JointHistogram {
  double steepest = 0;  // the greatest slope counted: data values per unit of the world
  // [value][slope]: voxels in equal bins of values over the range of the volume, and of square roots of slopes up to the steepest.
  std::vector<std::uint64_t> counts = std::vector<std::uint64_t>(std::size_t{kJointValues} * kJointSlopes);
  friend bool operator==(const JointHistogram&, const JointHistogram&) = default;
};

// Returns all voxels of a box that lies in the volume. The first error ends the count.
using ReadJointBox = std::function<Result<VoxelBlock>(const Box& box)>;

// Counts voxels in boxes at equal distances, all of them together at most about 2 million voxels, so that it takes milliseconds for any
// volume. Slopes are central differences, as renderers have them; the outermost voxels of the volume and neighbours of voxels that are not
// finite do not count. `range`: of the finite data values.
Result<JointHistogram> CountJointly(const VolumeDescription& volume, ValueRange range, const ReadJointBox& read);

}  // namespace slabstream
