// Counts how often which value occurs together with which slope: a JointHistogram.
#pragma once

#include <functional>

#include "common/base/status.h"
#include "common/stats/probe_results.h"
#include "common/volume/bricks.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

// Returns all voxels of a box that lies in the volume. The first error ends the count.
using ReadJointBox = std::function<Result<VoxelBlock>(const Box& box)>;

// Counts voxels in boxes at equal distances, all of them together at most about 2 million voxels, so that it takes milliseconds for any
// volume. Slopes are central differences, as renderers have them; the outermost voxels of the volume and neighbours of voxels that are not
// finite do not count. `range`: of the finite data values.
Result<JointHistogram> CountJointly(const VolumeDescription& volume, ValueRange range, const ReadJointBox& read);

}  // namespace slabstream
