// A surface normal in 15 bits. Shading is two-sided, so only the line through a normal counts. The hemi-octahedral map (Cigolle et al., A
// survey of efficient representations for independent unit vectors, 2014) lays the half with z >= 0 out on a square, and the result is
// rounded to a grid of kNormalGrid x kNormalGrid. The grid is odd, so the three axes have exact codes. Largest error 0.8 degrees.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/math/vec.h"

namespace slabstream {

inline constexpr int kNormalGrid = 181;
inline constexpr std::uint16_t kNoGradient = kNormalGrid * kNormalGrid;  // the code of voxels whose gradient is zero or not finite
inline constexpr int kNormalCodes = kNoGradient + 1;

// Code of the line along (x, y, z), of any length. Without branches: it runs over whole rows.
inline std::uint16_t EncodeNormal(float x, float y, float z) {
  const float length = std::abs(x) + std::abs(y) + std::abs(z);  // in the octahedral norm
  const bool valid = length > 0 && length <= std::numeric_limits<float>::max();
  const float scale = valid ? (z < 0 ? -1.0F : 1.0F) / length : 0.0F;
  const float px = valid ? x * scale : 0.0F, py = valid ? y * scale : 0.0F;
  constexpr float kHalf = 0.5F * (kNormalGrid - 1);
  const auto u = std::int32_t((px + py) * kHalf + (kHalf + 0.5F)), v = std::int32_t((px - py) * kHalf + (kHalf + 0.5F));
  return std::uint16_t(valid ? std::min(v, kNormalGrid - 1) * kNormalGrid + std::min(u, kNormalGrid - 1) : kNoGradient);
}

// Unit vector with z >= 0; code below kNoGradient.
inline Vec3 DecodeNormal(std::uint16_t code) {
  constexpr double kHalf = 0.5 * (kNormalGrid - 1);
  const double u = code % kNormalGrid / kHalf - 1, v = code / kNormalGrid / kHalf - 1;  // NOLINT(bugprone-integer-division): grid places
  const double x = 0.5 * (u + v), y = 0.5 * (u - v);
  return Normalized({x, y, 1 - std::abs(x) - std::abs(y)});
}

}  // namespace slabstream
