// ProjectTile: the kernel of projections. It reduces the samples of a box along a pixel's ray to one value: the largest, the least, or
// their sum.
//
// Samples are interpolated trilinearly and clamped to the range of their eight voxels, so that a cell's range bounds them exactly. Where
// one of these is not finite, the others are interpolated if the nearest one is among them; else the sample is skipped. So a voxel without
// a value leaves a hole of its own size. Results have the same bits on every instruction set, and combining the boxes of any partition
// gives the same bits as one box:
//
//   extreme  the extreme of `sign` * sample; then normalised, which is monotonic
//   sum      sums of integers
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/rays/field_map.h"
#include "worker/rays/ray_box.h"
#include "worker/shapes/fragment_order.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// Bounds of what a ray may find: an upper bound of sign * sample for each cell of kCellSide voxels, and for each block of kBlockSide.
inline constexpr int kBlockShift = 4;
inline constexpr std::int32_t kBlockSide = 1 << kBlockShift;
inline constexpr int kWindowStep = 2;
struct SampleBounds {
  std::vector<float> cells, blocks;                // lowest float: no finite sample
  std::vector<float> cell_windows, block_windows;  // of each one and those after it, up to kWindowStep farther on along each axis
  float most = 0;                                  // the bound for all samples
  Index3 block_counts;

  std::size_t bytes() const { return 2 * (cells.capacity() + blocks.capacity()) * sizeof(float); }
};
SampleBounds BoundSamples(const MacrocellRanges& cells, float sign);

// How samples become values: value = clamp((sample - low) * scale, 0, 1).
struct ValueScale {
  float low = 0, scale = 1;
};
// The scale for data values that makes `least` 0 and `largest` 1; all values are 0 unless least < largest.
inline ValueScale MakeValueScale(double least, double largest, const ValueMapping& mapping) {
  if (mapping.scale == 0 || !(least < largest)) return {0, 0};
  return {float((least - mapping.offset) / mapping.scale), float(mapping.scale / (largest - least))};
}

struct ProjectWork {
  const ViewRays* rays = nullptr;
  const RayBox* box = nullptr;
  const FieldMap* field = nullptr;       // the box's voxels are those of another field of the frame, which lies so; null: the volume's
  const SampleBounds* bounds = nullptr;  // for the same sign
  float sign = 1;                        // 1: the largest sample; -1: the least
  ValueScale values;
  bool complement = false;                 // store 1 - value, which is largest for the least value
  bool nearest = false;                    // samples are those of the nearest voxel, not interpolated
  const ShapeTile* shapes = nullptr;       // that holds the tile's pixels: rays end where it is opaque; null: nowhere
  const FragmentOrder* order = nullptr;    // of the frame, if there are shapes
  const SampleBounds* opposite = nullptr;  // bounds for the other sign: the sum is wanted; null: the extreme
};

// Four floats a pixel of `tile`; `pixels` points to the first pixel's. Pixels without a sample may stay unwritten: they must be 0 before.
//   the extreme: (value of the extreme sample, or 1 - value, 0, 0, 1)
//   the sum:     the sums over all samples of the bytes of floor(value * 2^24), at most 2^24 - 1, highest first, and their number
void ProjectTile(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row);

}  // namespace slabstream
