// ProjectTile: the kernel of intensity projections. The samples of a box along a pixel's ray become one value: the largest, the least, or
// their mean.
//
// Samples are interpolated trilinearly and kept within the range of their eight voxels, so that a cell's range bounds them exactly. Samples
// that are not finite count as none. All results are the same bits on every instruction set, and combining the boxes of any partition gives
// the bits of one box:
//
//   extreme  the extreme of `sign` * sample; then normalised, which is monotonic
//   mean     sums of integers
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/rays/ray_box.h"

namespace slabstream {

// Bounds of what a ray may find: an upper bound of sign * sample for each cell of kCellSide voxels, and for each block of kBlockSide.
inline constexpr int kBlockShift = 4;
inline constexpr std::int32_t kBlockSide = 1 << kBlockShift;
struct SampleBounds {
  std::vector<float> cells, blocks;  // lowest float: no finite sample
  float most = 0;                    // of all
  Index3 block_counts;

  std::size_t bytes() const { return (cells.capacity() + blocks.capacity()) * sizeof(float); }
};
SampleBounds BoundSamples(const CellRanges& cells, float sign);

struct ProjectWork {
  const ViewRays* rays = nullptr;
  const RayBox* box = nullptr;
  const SampleBounds* bounds = nullptr;  // for the same sign; of a mean: null
  float sign = 1;                        // 1: the largest sample; -1: the least
  // Of a sample: value = clamp((sample - low) * scale, 0, 1).
  float low = 0, scale = 1;
  bool complement = false;  // store 1 - value, of which the largest is that of the least value
};

// Four floats a pixel of `tile`, the first one's at `pixels`. Pixels without a sample may be left as they are: they must be 0 before.
//   bounds given: (value of the extreme sample, or 1 - value, 0, 0, 1)
//   null:         the sums over all samples of the bytes of floor(value * 2^24), at most 2^24 - 1, highest first, and their number
void ProjectTile(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row);

// The definition: one ray and one sample after the other. The same bits.
void ProjectTileReference(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row);

}  // namespace slabstream
