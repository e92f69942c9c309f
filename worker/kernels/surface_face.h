// A face of the surface of opaque voxels: a side of a cell [q - 0.5, q + 0.5) whose neighbour on that side is not opaque.
//
// The two axes of a face are the other two in ascending order, u and v. Its corners are numbered 0 (low u, low v), 1 (high u, low v),
// 2 (low u, high v), 3 (high u, high v).
#pragma once

#include <array>
#include <cstdint>

namespace slabstream {

inline constexpr int kSides = 6;              // sides of a cell: 2 * axis + (1: towards higher indices)
inline constexpr int kFaceBrick = 16;         // kBrick (volume.h), which FaceIndex spells in bits
inline constexpr int kBinBits = 12;           // the bin's bits in FaceSite::bin_and_side
inline constexpr int kNormalBits = 10;        // bits of one component of a packed normal
inline constexpr float kNormalUnit = 511.0F;  // length of a packed unit normal

struct FaceSite {
  std::uint16_t x = 0, y = 0, z = 0;  // the voxel, of the volume
  std::uint16_t bin_and_side = 0;     // classification bin, side << kBinBits
  friend bool operator==(const FaceSite&, const FaceSite&) = default;
};

// Normals at the four corners, packed: x, y, z (physical axes) from bit 0, 10, 20 on, signed, kNormalUnit long; 0: there is no gradient.
using FaceNormals = std::array<std::uint32_t, 4>;

// The order of all faces of a volume, which breaks ties of depth: by brick (x fastest), side, and voxel. Voxels with equal parities of x, y
// and z follow each other, so that consecutive faces do not touch the same pixels, whose keys are still on their way to memory. Two sides
// of one axis never tie, so a face's index contains only its axis. Its low 32 bits distinguish all faces that can meet.
constexpr std::uint32_t FaceIndex(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t axis, std::uint32_t bricks_x,
                                  std::uint32_t bricks_y) {
  const std::uint32_t brick = ((z >> 4) * bricks_y + (y >> 4)) * bricks_x + (x >> 4);
  const std::uint32_t parities = (z & 1) << 2 | (y & 1) << 1 | (x & 1);
  return brick << 14 | axis << 12 | parities << 9 | (z >> 1 & 7) << 6 | (y >> 1 & 7) << 3 | (x >> 1 & 7);
}

}  // namespace slabstream
