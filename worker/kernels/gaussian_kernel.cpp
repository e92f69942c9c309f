#include "worker/kernels/gaussian_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/view/camera.h"

namespace slabstream {

double GaussianWeight(double d, double sigma) {
  constexpr double kCut = kFootprintCut;
  static const double at_cut = std::exp(-0.5 * kCut * kCut);
  // The integral of exp(-s^2 / 2) - at_cut over [-kCut, kCut].
  static const double mass = std::sqrt(2 * std::numbers::pi) * std::erf(kCut / std::numbers::sqrt2) - 2 * kCut * at_cut;
  const double s = d / sigma;
  return std::abs(s) < kCut ? (std::exp(-0.5 * s * s) - at_cut) / (mass * sigma) : 0.0;
}

float TapWeight(const GaussianKernel& kernel, std::int32_t phase, std::int32_t tap) {
  return float(GaussianWeight(1 + tap - (phase + 0.5) / kernel.phases - kernel.radius, kernel.sigma));
}

GaussianKernel MakeGaussianKernel(double sigma) {
  GaussianKernel kernel;
  kernel.sigma = sigma;
  kernel.radius = kFootprintCut * sigma;
  kernel.taps = std::int32_t(std::ceil(2 * kernel.radius));
  kernel.padded_taps = (kernel.taps + kTapPadding - 1) / kTapPadding * kTapPadding;
  kernel.phases = sigma >= kMaxPhases ? 1 : int(std::bit_ceil(unsigned(kMaxPhases / std::max(sigma, 1.0))));
  for (int phase = 0; phase < kernel.phases; ++phase) {
    const auto used = std::int32_t(std::ceil(2 * kernel.radius - 1 + (phase + 0.5) / kernel.phases));
    kernel.phase_rows.push_back(used);
    kernel.phase_columns.push_back((used + kTapPadding - 1) / kTapPadding * kTapPadding);
  }
  if (kernel.taps > kMaxTableTaps) return kernel;
  kernel.x_weights.assign(std::size_t(kernel.phases) * std::size_t(kernel.padded_taps) * 4, 0.0F);
  kernel.y_weights.reserve(std::size_t(kernel.phases) * std::size_t(kernel.taps));
  for (int phase = 0; phase < kernel.phases; ++phase) {
    for (std::int32_t tap = 0; tap < kernel.taps; ++tap) {
      const float weight = TapWeight(kernel, phase, tap);
      kernel.y_weights.push_back(weight);
      std::fill_n(&kernel.x_weights[(std::size_t(phase) * std::size_t(kernel.padded_taps) + std::size_t(tap)) * 4], 4, weight);
    }
  }
  return kernel;
}

}  // namespace slabstream
