// A volume that three processes hold, a slab and a ball in it each. At each time the balls are elsewhere, but never at a slab's border.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "tests/support/random_volume.h"

namespace slabstream {

inline constexpr std::uint32_t kBalls = 3;
inline constexpr Index3 kBallsSize = {32, 32, 16 * kBalls};
inline constexpr std::uint64_t kBallsPeriod = 5;  // then the times repeat

inline Box SlabOf(std::uint32_t owner) { return {{0, 0, std::int32_t(16 * owner)}, {32, 32, std::int32_t(16 * (owner + 1))}}; }

// `without`: the voxels of this owner are 0.
inline Volume BallsAt(std::uint64_t time, std::optional<std::uint32_t> without = {}) {
  return MakeTestVolume(kBallsSize, ScalarType::kUint8, [&](const Index3& v) {
    double value = 0;
    if (without && SlabOf(*without).Contains(Box{v, v + Uniform(1)})) return value;
    for (std::uint32_t owner = 0; owner < kBalls; ++owner) {
      const Vec3 center = {12 + 2 * double(time % kBallsPeriod), 16, 16 * double(owner) + 8};
      value = std::max(value, 250 - 25 * Length(ToVec3(v) - center));
    }
    return value;
  });
}

}  // namespace slabstream
