// FootprintTable: the one-dimensional footprint of a voxel, tabulated for sample positions between two voxels.
//
// A sample at t voxels (from a voxel's centre) is a weighted mean of the voxels within the radius R = cut * sigma:
//   first = floor(t - R) + 1;   phase = floor(kPhases * frac(t - R));   sum over n < taps of weight(phase, n) * voxel[first + n]
// with weight(phase, n) = g(d) / (sum of g over the phase's taps) for the distance d of voxel first + n at the middle of the phase,
//   g(d) = exp(-d^2 / (2 sigma^2)) - exp(-cut^2 / 2) for |d| < R, else 0.
// Weights of a phase sum to 1, so a slice of equal voxels yields samples equal to them. The value of the Gaussian at the cut is subtracted,
// so that it ends without a step. A sample's position is off by at most 1 / (2 kPhases) voxel.
//
// Positions are fixed point with 32 fractional bits (Lattice): exact from sample to sample and the same everywhere.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/memory/aligned_buffer.h"

namespace slabstream {

inline constexpr int kPhaseBits = 7, kPhases = 1 << kPhaseBits;
inline constexpr std::int32_t kLeastPaddedTaps = 4;  // taps of four channels, 16 floats: the widest vector

struct FootprintTable {
  double radius = 0;             // voxels
  std::int32_t taps = 0;         // ceil(2 radius)
  AlignedVector<float> weights;  // [phase][taps]

  // The same for pixels of four channels: every weight four times. The number of taps is even and fills the widest vector: weights beyond
  // `taps` are 0.
  std::int32_t padded_taps = 0;
  AlignedVector<float> channel_weights;  // [phase][padded_taps][4]
};

// sigma in (0, 1000] voxels; cut: in standard deviations.
FootprintTable MakeFootprintTable(double sigma, double cut);

// The samples i = 0, 1, ... of a row: sample i lies at t - R + 1 = (start + i * step) / 2^32 voxels, so its first tap is the integer part
// and its phase the leading bits of the fraction.
struct Lattice {
  std::int64_t start = 0, step = 0;

  std::int64_t At(std::int32_t i) const { return start + i * step; }
  static std::int32_t First(std::int64_t at) { return std::int32_t(at >> 32); }
  static std::size_t Phase(std::int64_t at) { return std::size_t(std::uint32_t(at) >> (32 - kPhaseBits)); }
};

// For samples at column i + 0.5 = scale * u + offset and a footprint of this radius. Positions are clamped to 2^30 voxels.
Lattice MakeLattice(double scale, double offset, double radius);

// The first sample i with At(i) at or beyond a position, for evenly spaced positions in turn: additions only, after two divisions.
class FirstSamples {
 public:
  FirstSamples(const Lattice& lattice, std::int64_t place, std::int64_t stride);

  // For the current position, in [begin, end].
  std::int32_t In(std::int32_t begin, std::int32_t end) const {
    if (step_ <= 0) return sample_ <= 0 ? begin : end;
    return std::int32_t(std::clamp<std::int64_t>(sample_, begin, end));
  }
  void Next() {
    sample_ += stride_samples_;
    beyond_ += stride_beyond_;
    if (step_ > 0 && beyond_ >= step_) {
      beyond_ -= step_;
      ++sample_;
    }
  }

 private:
  std::int64_t step_;                                    // 0: samples stand still; then sample_ is the distance to the position
  std::int64_t sample_ = 0, beyond_ = 0;                 // ceil(distance / step); distance + step - 1 is sample_ * step + beyond_
  std::int64_t stride_samples_ = 0, stride_beyond_ = 0;  // the same for the stride, rounded down
};

// The first sample whose position u is at or beyond `voxel`, in [begin, end].
std::int32_t FirstSampleFrom(const Lattice& lattice, double radius, double voxel, std::int32_t begin, std::int32_t end);

}  // namespace slabstream
