// The shading stage of splatting: looks up what each occupied voxel adds to its sheet.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/memory/aligned_buffer.h"
#include "worker/kernels/phong_table.h"
#include "worker/kernels/voxel_record.h"

namespace slabstream {

// Made once a frame. A voxel's opacity is its opacity in the sheet. Under perspective this depends on the distance between sheets along the
// voxel's own ray, so there are tables for `levels` evenly spaced distances; opacities in between are interpolated linearly.
struct ShadeTables {
  int levels = 1;
  AlignedVector<float> color;           // [bin][4]: straight colour, then the opacity of level 0
  AlignedVector<float> opacity;         // [bin][level]; one level: not read
  std::vector<PhongFactors> by_normal;  // by normal code

  // For a voxel on a ray with slopes s and t along u and v (distance along the axis per distance along the traversal axis), the level is
  // clamp(level_scale * sqrt(1 + s^2 + t^2) - level_offset, 0, last_level), with last_level < levels - 1.
  float level_scale = 0, level_offset = 0, last_level = 0;
};

// Shadows and ambient occlusion of the voxels of an octet: the factors of a normal are multiplied by `scale`, then `add` is added; diffuse,
// then specular.
struct OctetShares {
  alignas(64) float scale[kOctet][2];
  alignas(64) float add[kOctet][2];
};

// An octet with at least one occupied voxel.
struct OctetWork {
  const VoxelRecord* records = nullptr;  // its occupied voxels, in order
  float* rgba = nullptr;                 // 4 * kOctet floats, 64-byte aligned: opacity * (shaded colour, 1), or 0 for empty voxels
  std::uint32_t occupied = 0;            // bit i: voxel i
  float slope = 0, across = 1;           // s of voxel 0, and 1 + t^2. One level: not read
  const OctetShares* shares = nullptr;   // its shares; either all octets of a call have some, or none
};

// slope_step: from voxel to voxel.
void ShadeOctets(const ShadeTables& tables, float slope_step, std::span<const OctetWork> octets);
// Zeroes what ShadeOctets wrote.
void ClearOctets(std::span<const OctetWork> octets);

}  // namespace slabstream
