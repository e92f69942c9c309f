// VoxelRecord: what is kept of an occupied voxel from frame to frame.
#pragma once

#include <cstdint>

namespace slabstream {

struct VoxelRecord {
  std::uint16_t bin;     // of the classification table
  std::uint16_t normal;  // normal_code.h
};

inline constexpr std::int32_t kOctet = 8;  // voxels of a beam, from a global multiple of 8 on: what is shaded or skipped as a whole

}  // namespace slabstream
