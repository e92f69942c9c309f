// PaddedVoxels: the samples of a box and of kPad voxels around it, in one array, x fastest. Beyond the volume's border the nearest voxel's
// sample is repeated, so a kernel reads all neighbours of a sample without testing where the volume ends.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/large_array.h"
#include "common/volume/bricks.h"

namespace slabstream {

// A sample at position p with begin - 0.5 <= p < end - 0.5 lies between voxels floor(p) and floor(p) + 1; its gradient reaches one further.
inline constexpr std::int32_t kPad = 2;

struct PaddedVoxels {
  Box box;  // of the volume, without the padding
  ScalarType type = ScalarType::kUint8;
  std::int32_t row = 0;           // samples from a voxel to the next along y
  std::int64_t slice = 0;         // along z
  LargeArray<std::byte> samples;  // the first is that of voxel box.begin - kPad

  std::size_t bytes() const {
    return samples == nullptr ? 0 : std::size_t(slice) * std::size_t(box.size().z + 2 * kPad) * BytesPerSample(type);
  }
};

// `box` is not empty. It lies in `voxels`, and so do the volume's voxels within kPad of it. Parallel.
PaddedVoxels Pad(const VoxelBricks& voxels, const Box& box);

}  // namespace slabstream
