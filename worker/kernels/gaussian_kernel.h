// GaussianKernel: the one-dimensional footprint of a voxel, tabulated at sub-pixel phases. A footprint is the product of one in x and one
// in y.
//
//   g(d) = (exp(-d^2 / (2 sigma^2)) - exp(-kFootprintCut^2 / 2)) / m   for |d| < kFootprintCut * sigma, else 0;  m: so that g integrates to
//   1
//
// The Gaussian is lowered by its value at the cut, so that it ends without a step: summed over a filled slice, the steps of a plain cut
// make ripples 2.4 times larger at one pixel a voxel.
//
// A voxel centred at image coordinate x covers the pixels column, column + 1, ... column + taps - 1 of its row, where
//   t = x - 0.5 - radius;   column = floor(t) + 1;   phase = floor((t - floor(t)) * phases)
// and tap j of a phase holds g at the middle of the phase's interval: g(1 + j - (phase + 0.5) / phases - radius).
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/aligned_buffer.h"

namespace slabstream {

// Weights of x are repeated for the four channels, so that a row of a footprint is a few vector operations on interleaved RGBA; their taps
// are padded with zeros to a multiple of kTapPadding pixels: one 32-byte register.
inline constexpr int kTapPadding = 2;
inline constexpr int kMaxPhases = 64;
inline constexpr int kMaxTableTaps =
    4096;  // wider kernels (extreme zoom) have no tables: weights are computed for the pixels that are seen

struct GaussianKernel {
  double sigma = 0;   // pixels
  double radius = 0;  // pixels: kFootprintCut * sigma
  std::int32_t taps = 0;
  std::int32_t padded_taps = 0;
  // A power of two, the more the narrower the kernel. The centre is off by at most 1 / (2 * phases) pixel: 1/128 pixel up to sigma = 1,
  // about sigma / 64 above.
  int phases = 0;
  bool has_tables() const { return !y_weights.empty(); }

  // [phase]: taps that are not 0, which is often one less than `taps`; columns are rounded up to kTapPadding.
  std::vector<std::int32_t> phase_rows, phase_columns;
  AlignedVector<float> x_weights;  // [phase][padded_taps][4]
  AlignedVector<float> y_weights;  // [phase][taps]
};

// g(d): the definition. d and sigma in pixels.
double GaussianWeight(double d, double sigma);

// g at the middle of a phase's interval, as the tables hold it.
float TapWeight(const GaussianKernel& kernel, std::int32_t phase, std::int32_t tap);

GaussianKernel MakeGaussianKernel(double sigma);

}  // namespace slabstream
