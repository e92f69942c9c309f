// TurnedVoxels: the samples of a padded box in the order in which passes read them, so that every beam of the first pass is contiguous. The
// axes are those of ShearPasses.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/memory/large_array.h"
#include "common/volume/bricks.h"

namespace slabstream::shear {

// Samples beyond each end of a beam, which repeat its last one: a kernel needs no more to see the same value farther out.
inline constexpr std::int32_t kBeamPad = 3;

struct TurnedVoxels {
  std::array<Axis, 3> axes{};
  ScalarType type = ScalarType::kUint8;
  std::array<std::int32_t, 3> begin{}, end{};  // voxels, by place in `axes`
  std::int32_t beam = 0;                       // samples of a beam, with its ends
  LargeArray<std::byte> samples;               // [z][y][beam]

  // The beam at (y, z), or the nearest one; its first sample is that of voxel begin[0] - kBeamPad. T: of `type`.
  template <class T>
  const T* Beam(std::int32_t y, std::int32_t z) const {
    const std::int32_t row = std::clamp(y, begin[1], end[1] - 1) - begin[1], slice = std::clamp(z, begin[2], end[2] - 1) - begin[2];
    return reinterpret_cast<const T*>(samples.get()) + (std::ptrdiff_t{slice} * (end[1] - begin[1]) + row) * beam;
  }
  std::size_t bytes() const {
    return samples == nullptr ? 0
                              : std::size_t(beam) * std::size_t(end[1] - begin[1]) * std::size_t(end[2] - begin[2]) * BytesPerSample(type);
  }
};

// Parallel.
TurnedVoxels Turn(const VoxelBricks& voxels, const std::array<Axis, 3>& axes);

}  // namespace slabstream::shear
