#include "worker/kernels/footprint_table.h"

#include <cmath>
#include <vector>

namespace slabstream {
namespace {

constexpr double kOne = 0x1p32;
constexpr double kFarthest = 0x1p30;  // voxels

std::int64_t ToFixed(double voxels) { return std::int64_t(std::floor(std::clamp(voxels, -kFarthest, kFarthest) * kOne)); }

}  // namespace

FootprintTable MakeFootprintTable(double sigma, double cut) {
  FootprintTable table;
  table.radius = cut * sigma;
  table.taps = std::int32_t(std::ceil(2 * table.radius));
  table.weights.resize(std::size_t(kPhases) * std::size_t(table.taps));
  table.padded_taps = std::max((table.taps + 1) / 2 * 2, kLeastPaddedTaps);
  table.channel_weights.resize(4 * std::size_t(kPhases) * std::size_t(table.padded_taps));
  // A tap's distances over the phases are evenly spaced, so its Gaussian is a product of two geometric sequences: exp((d - h)^2) =
  // exp(d^2) exp(-2 h d + h^2).
  struct Tap {
    double distance = 0, gaussian = 0, ratio = 0;  // ratio: of the next phase's Gaussian to this one's
  };
  const double at_cut = std::exp(-0.5 * cut * cut);
  const double a = -0.5 / (sigma * sigma), h = 1.0 / kPhases, per_phase = std::exp(2 * a * h * h);
  std::vector<Tap> taps(std::size_t(table.taps));
  for (std::size_t n = 0; n < taps.size(); ++n) {
    const double d = 1 - 0.5 * h + double(n) - table.radius;
    taps[n] = {d, std::exp(a * d * d), std::exp(a * (h * h - 2 * h * d))};
  }
  std::vector<double> g(taps.size());
  for (int phase = 0; phase < kPhases; ++phase) {
    double sum = 0;
    for (std::size_t n = 0; n < taps.size(); ++n) {
      Tap& tap = taps[n];
      const double d = tap.distance - phase * h;
      sum += g[n] = std::abs(d) < table.radius ? tap.gaussian - at_cut : 0;
      tap.gaussian *= tap.ratio;
      tap.ratio *= per_phase;
    }
    for (std::size_t n = 0; n < taps.size(); ++n) {
      const auto weight = float(g[n] / sum);
      table.weights[std::size_t(phase) * taps.size() + n] = weight;
      std::fill_n(&table.channel_weights[4 * (std::size_t(phase) * std::size_t(table.padded_taps) + n)], 4, weight);
    }
  }
  return table;
}

Lattice MakeLattice(double scale, double offset, double radius) {
  return {ToFixed((0.5 - offset) / scale - radius + 1), ToFixed(1 / scale)};
}

FirstSamples::FirstSamples(const Lattice& lattice, std::int64_t place, std::int64_t stride) : step_(lattice.step) {
  const std::int64_t distance = place - lattice.start;  // to be reached by i * step
  if (step_ <= 0) {
    sample_ = distance;
    stride_samples_ = stride;
    return;
  }
  const auto floor_divide = [&](std::int64_t n) { return n >= 0 ? n / step_ : -((step_ - 1 - n) / step_); };
  sample_ = floor_divide(distance + step_ - 1);
  beyond_ = distance + step_ - 1 - sample_ * step_;
  stride_samples_ = floor_divide(stride);
  stride_beyond_ = stride - stride_samples_ * step_;
}

std::int32_t FirstSampleFrom(const Lattice& lattice, double radius, double voxel, std::int32_t begin, std::int32_t end) {
  return FirstSamples(lattice, ToFixed(voxel - radius + 1), 0).In(begin, end);
}

}  // namespace slabstream
