#include "worker/kernels/footprint_table.h"

#include <algorithm>
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
  table.padded_taps = (table.taps + 1) / 2 * 2;
  table.channel_weights.resize(4 * std::size_t(kPhases) * std::size_t(table.padded_taps));
  std::vector<double> g(std::size_t(table.taps));
  for (int phase = 0; phase < kPhases; ++phase) {
    double sum = 0;
    for (std::size_t n = 0; n < g.size(); ++n) {
      const double d = 1 - (phase + 0.5) / kPhases + double(n) - table.radius;
      g[n] = std::abs(d) < table.radius ? std::exp(-0.5 * d * d / (sigma * sigma)) - std::exp(-0.5 * cut * cut) : 0;
      sum += g[n];
    }
    for (std::size_t n = 0; n < g.size(); ++n) {
      const auto weight = float(g[n] / sum);
      table.weights[std::size_t(phase) * g.size() + n] = weight;
      std::fill_n(&table.channel_weights[4 * (std::size_t(phase) * std::size_t(table.padded_taps) + n)], 4, weight);
    }
  }
  return table;
}

Lattice MakeLattice(double scale, double offset, double radius) {
  return {ToFixed((0.5 - offset) / scale - radius + 1), ToFixed(1 / scale)};
}

std::int32_t FirstSampleAt(const Lattice& lattice, std::int64_t place, std::int32_t begin, std::int32_t end) {
  const std::int64_t distance = place - lattice.start;  // to be reached by i * step
  if (lattice.step <= 0) return distance <= 0 ? begin : end;
  const std::int64_t i = distance >= 0 ? (distance + lattice.step - 1) / lattice.step : -(-distance / lattice.step);
  return std::int32_t(std::clamp<std::int64_t>(i, begin, end));
}

std::int32_t FirstSampleFrom(const Lattice& lattice, double radius, double voxel, std::int32_t begin, std::int32_t end) {
  return FirstSampleAt(lattice, ToFixed(voxel - radius + 1), begin, end);
}

}  // namespace slabstream
