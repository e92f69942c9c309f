// SmoothLabel: the material of a place if labels are smoothed (LabelSurface::kSmooth; docs/rendering.md, Labels).
//
//   w(v)   weight of voxel v at the place: the cubic B-spline along each axis (Unser 1999), over the 4 x 4 x 4 voxels around. The sum is 1
//   m(a)   membership: the sum of w over the voxels whose opacity is at least a
//
// The opacity of the place is the greatest a for which m(a) reaches 1/2. Its label is the one of that opacity with most weight. Its normal
// is the gradient of m(a), averaged over the 3 x 3 x 3 places around that are a voxel apart: the gradient at one place tells the steps of
// voxels.
#pragma once

#include <array>
#include <cstdint>

#include "common/math/vec.h"

namespace slabstream {

// Sums of weights differ by less than this where only rounding makes them differ. So rounding decides nothing half-way between voxels.
inline constexpr double kWeightMargin = 1e-5;
inline constexpr double kHalfMembership = 0.5 - kWeightMargin;

// Voxels before and behind a place that its normal depends on.
inline constexpr std::int32_t kSmoothReach = 3;

struct LabelledVoxel {
  std::uint64_t label = 0;
  double opacity = -1;  // LabelStyle::opacity; -1: it is not shown
  friend bool operator==(const LabelledVoxel&, const LabelledVoxel&) = default;
};

// `around`: voxels floor(p) - 1 to floor(p) + 2 along each axis, x fastest; `fraction`: p - floor(p). Where nothing is shown: {}.
LabelledVoxel SmoothLabel(const std::array<LabelledVoxel, 64>& around, const Vec3& fraction);

}  // namespace slabstream
