// VoxelRecord: data of an occupied voxel that is kept between frames.
#pragma once

#include <cstdint>

namespace slabstream {

struct VoxelRecord {
  std::uint16_t bin;     // the bin in the classification table
  std::uint16_t normal;  // normal_code.h
};

inline constexpr std::int32_t kOctet = 8;  // voxels of a beam, from a global multiple of 8 on: the unit of shading and skipping

}  // namespace slabstream
