// PaddedVoxels: the samples of a box and of kPad voxels around it, in one array, x fastest. Beyond the volume's border the nearest voxel's
// sample is repeated, so a kernel reads all neighbours of a sample without testing where the volume ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "common/memory/large_array.h"
#include "common/volume/bricks.h"

namespace slabstream {

// A sample at position p with begin - 0.5 <= p < end - 0.5 lies between voxels floor(p) and floor(p) + 1; its gradient reaches one further.
inline constexpr std::int32_t kPad = 2;

// Copies share their samples.
struct PaddedVoxels {
  Box box;  // the box in the volume, without the padding
  ScalarType type = ScalarType::kUint8;
  std::int32_t row = 0;                  // samples from a voxel to the next along y
  std::int64_t slice = 0;                // along z
  std::shared_ptr<std::byte[]> samples;  // the first is that of voxel box.begin - kPad

  // Where the sample of a voxel of the padded box is.
  std::byte* At(const Index3& voxel) const {
    const Index3 offset = voxel - box.begin + Uniform(kPad);
    return samples.get() + (offset.z * slice + std::int64_t{offset.y} * row + offset.x) * std::int64_t(BytesPerSample(type));
  }
  VoxelBricks bricks() const { return {box, type, At(box.begin), row, std::ptrdiff_t(slice)}; }  // without the padding
  std::size_t bytes() const { return std::size_t(slice) * std::size_t(box.size().z + 2 * kPad) * BytesPerSample(type); }
};

// All samples are 0. Those that are never written take no memory.
PaddedVoxels MakePaddedVoxels(const Box& box, ScalarType type);

// Gives the voxels of `box`, which lies in that of `voxels` and whose samples are still 0, the sample of the type that is nearest to
// `sample`, which is finite. Parallel.
void FillBox(const PaddedVoxels& voxels, const Box& box, float sample);

// Repeats the samples at the faces of the box in the padding, all of which is still 0. Parallel.
void FillPadding(const PaddedVoxels& voxels);

// `box` is not empty. It lies in `voxels`, and so do the volume's voxels within kPad of it. Parallel.
PaddedVoxels Pad(const VoxelBricks& voxels, const Box& box);

}  // namespace slabstream
