// A box of a level becomes its part of the next coarser one. Pure; parallel, with the same result for any number of threads.
#pragma once

#include <cstddef>

#include "data/volume_io/sample_type.h"

namespace slabstream {

enum class Reduction {
  kMean,          // rounded to the nearest whole number, halves away from zero; without NaN, unless all are NaN
  kMostFrequent,  // for labels; if several are equally frequent, the smallest
};

// Each voxel of the result holds `step` (1 or 2 along each axis) voxels of `from`, those at its end perhaps fewer. `from`: samples of a box
// of `size` voxels, x fastest, whose begin is a multiple of `step` of its level. `to`: samples of a box of `to_size` voxels of the next
// level; the result begins at voxel `at` of it. Both are aligned for `type`.
void Reduce(SampleType type, Reduction reduction, const std::byte* from, const Index3& size, const Index3& step, std::byte* to,
            const Index3& to_size, const Index3& at);

}  // namespace slabstream
