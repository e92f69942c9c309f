// The weights of a sample's eight voxels where these are whole numbers: the same as WeightsAt (ray_packet-inl.h).
#pragma once

#include <cmath>
#include <cstddef>

#include "worker/rays/view_rays.h"

namespace slabstream::testing {

// In 2^-14. `fraction`: from the sample's floor; `corner`: the voxel's number, x fastest.
inline int WholeWeight(const Float3& fraction, int corner) {
  // The part of a weight that is for one of two sides. Shares are whole numbers of 2^-15, but along x of 2^-14.
  const auto split = [&](int weight, std::size_t axis, int side) {
    const int upper = (weight * int(std::nearbyint(fraction[axis] * 32767.0F)) + 16384) >> 15;
    return side == 1 ? upper : weight - upper;
  };
  const int second = int(std::nearbyint(fraction[0] * 16384.0F));
  return split(split((corner & 1) == 1 ? second : 16384 - second, 1, corner >> 1 & 1), 2, corner >> 2);
}

}  // namespace slabstream::testing
