// MacrocellRanges: least and greatest sample of each macrocell, so that rays leap over macrocells that show nothing.
//
// A macrocell holds the sample positions p whose floor lies in a cube of kCellSide voxels, counted from box.begin - 1. Trilinear
// interpolation also reads the next voxel, so a macrocell's range is that of kCellSide + 1 voxels a side.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/function_ref.h"
#include "common/math/vec.h"
#include "worker/renderers/padded_voxels.h"

namespace slabstream {

inline constexpr int kCellShift = 2;
inline constexpr std::int32_t kCellSide = 1 << kCellShift;  // voxels

struct MacrocellRange {
  float min, max;  // stored samples, finite ones; min > max: there is none
};

struct MacrocellRanges {
  Index3 counts;  // numbers of macrocells, which cover the padded voxels; x fastest
  std::vector<MacrocellRange> ranges;

  std::size_t bytes() const { return ranges.capacity() * sizeof(MacrocellRange); }
};

// Parallel.
MacrocellRanges FindMacrocellRanges(const PaddedVoxels& voxels);

// By macrocell, which of its eighths, cubes of half its side, may show: bit o is set if eighth o may. Bit i of o is set for the upper half
// along axis i. `visible`: 0 for macrocells of which any_between(least, greatest value) is true; the others have none.
// `counts`: MacrocellRanges::counts of the voxels. Parallel.
std::vector<std::uint8_t> VisibleEighths(const PaddedVoxels& voxels, const Index3& counts, const std::vector<std::uint8_t>& visible,
                                         FunctionRef<bool(float, float)> any_between);

}  // namespace slabstream
