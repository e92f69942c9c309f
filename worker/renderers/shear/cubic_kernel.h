// CubicKernel: reconstruction along a line from four samples around a place: a window of two samples on either side.
//
// The kernels are those of Mitchell and Netravali (1988), with parameters B and C: Catmull-Rom (0, 1/2; Keys 1981) passes through the
// samples and keeps most detail, Mitchell (1/3, 1/3) blurs a little, the cubic B-spline (1, 0) more. Linear interpolation has a window of
// one sample.
//
// The result is kept within the range of its four samples, so that sharp kernels do not ring: nothing shows that no sample near has, and
// empty space stays empty.
#pragma once

#include <array>

#include "common/renderers/shear/shear_parameters.h"

namespace slabstream::shear {

// Weights of the samples at -1, 0, 1 and 2 for a place t in [0, 1): polynomials of t, constant term first. That of sample 1 is what is
// missing to 1.
struct CubicKernel {
  std::array<float, 4> before{}, at{}, behind{};  // samples -1, 0 and 2
};

inline CubicKernel MakeCubicKernel(Kernel kernel) {
  if (kernel == Kernel::kLinear) return {.before = {}, .at = {1, -1, 0, 0}, .behind = {}};
  const double b = kernel == Kernel::kMitchell ? 1.0 / 3 : kernel == Kernel::kBSpline ? 1 : 0;
  const double c = kernel == Kernel::kMitchell ? 1.0 / 3 : kernel == Kernel::kBSpline ? 0 : 0.5;
  // k(x) = (12 - 9B - 6C) x^3 + (-18 + 12B + 6C) x^2 + 6 - 2B, over 6, for x < 1
  // k(x) = (-B - 6C) x^3 + (6B + 30C) x^2 + (-12B - 48C) x + 8B + 24C, over 6, for 1 <= x < 2
  const auto outer = [&](double shift, double sign) {  // at x = shift + sign t
    const double q[4] = {(8 * b + 24 * c) / 6, (-12 * b - 48 * c) / 6, (6 * b + 30 * c) / 6, (-b - 6 * c) / 6};
    return std::array{float(q[0] + shift * (q[1] + shift * (q[2] + shift * q[3]))),
                      float(sign * (q[1] + shift * (2 * q[2] + 3 * shift * q[3]))), float(q[2] + 3 * shift * q[3]), float(sign * q[3])};
  };
  return {.before = outer(1, 1),
          .at = {float((6 - 2 * b) / 6), 0, float((-18 + 12 * b + 6 * c) / 6), float((12 - 9 * b - 6 * c) / 6)},
          .behind = outer(2, -1)};
}

}  // namespace slabstream::shear
