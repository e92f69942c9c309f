#include "laboratory/measure/splat_loops.h"

#include <algorithm>
#include <cmath>

#include "worker/kernels/splat.h"

namespace slabstream {
namespace {

constexpr std::int32_t kMargin = 32;    // empty voxels on both sides of a beam, and room round the frame: more than any footprint
constexpr std::int32_t kBandRows = 48;  // as in the pipeline

}  // namespace

DenseSlice::DenseSlice(std::int32_t side, double sigma, double scale)
    : side_(side),
      footprint_(MakeFootprintTable(sigma, 3)),
      pixels_((std::int32_t(side * scale) + 16) / kSegment * kSegment),
      lattice_(MakeLattice(scale, 4.3, footprint_.radius)),
      row_voxels_(side + 2 * kMargin),
      voxels_(4 * std::size_t(row_voxels_) * std::size_t(side)),
      accumulated_(4 * std::size_t(pixels_) * std::size_t(pixels_)),
      filtered_(4 * std::size_t(pixels_) * (2 * kBandRows + 2 * kMargin)),
      sheet_(4 * std::size_t(pixels_ + 2 * kMargin) * std::size_t(pixels_ + 2 * kMargin)),
      words_(SegmentWords(pixels_ / kSegment)),
      all_(std::size_t(words_)),
      open_(std::size_t(words_)) {
  for (std::int32_t row = 0; row < side_; ++row) {
    std::fill_n(&voxels_[4 * std::size_t(row * row_voxels_ + kMargin)], 4 * std::size_t(side_), 0.01F);
  }
  Insert(all_.data(), 0, pixels_ / kSegment);
}

void DenseSlice::SplatByKernels() {
  const std::int32_t taps = footprint_.taps;
  const std::size_t row_floats = 4 * std::size_t(pixels_);
  std::vector<const float*> beams(static_cast<std::size_t>(taps));
  const std::vector<const SegmentWord*> filled(std::size_t(taps), all_.data());
  for (std::int32_t band = 0; band < pixels_; band += kBandRows) {
    const std::int32_t end = std::min(band + kBandRows, pixels_);
    const std::int32_t first_beam = Lattice::First(lattice_.At(band)), last = Lattice::First(lattice_.At(end - 1)) + taps;
    for (std::int32_t beam = std::max(first_beam, 0); beam < std::min(last, side_); ++beam) {
      FilterBeam(footprint_, lattice_,
                 {&voxels_[4 * std::size_t(beam * row_voxels_ + kMargin)], &filtered_[std::size_t(beam - first_beam) * row_floats],
                  all_.data(), words_, 0});
    }
    for (std::int32_t row = band; row < end; ++row) {
      const std::int64_t at = lattice_.At(row);
      const std::int32_t first = std::max(Lattice::First(at), 0), count = std::min(Lattice::First(at) + taps, side_) - first;
      if (count <= 0) continue;
      for (std::int32_t n = 0; n < count; ++n) beams[std::size_t(n)] = &filtered_[std::size_t(first + n - first_beam) * row_floats];
      std::ranges::copy(all_, open_.begin());
      const float* weights = &footprint_.weights[Lattice::Phase(at) * std::size_t(taps) + std::size_t(first - Lattice::First(at))];
      CompositeRow({count, weights, beams.data(), filled.data(), &accumulated_[std::size_t(row) * row_floats], open_.data(), words_, 2});
    }
  }
}

// One voxel after the other, with a table of its footprint's weights as above.
void DenseSlice::SplatPlainly() {
  const std::int32_t taps = footprint_.taps, k = std::int32_t(std::lround(taps * 0x1p32 / double(lattice_.step)));
  const auto pixels = std::size_t(pixels_), sheet_row = std::size_t(pixels_ + 2 * kMargin);
  std::ranges::fill(sheet_, 0.0F);
  std::vector<float> along(static_cast<std::size_t>(k));
  for (std::int32_t v = 0; v < side_; ++v) {
    for (std::int32_t u = 0; u < side_; ++u) {
      const float* rgba = &voxels_[4 * std::size_t(v * row_voxels_ + kMargin + u)];
      const auto column = std::int32_t(double(u) * 0x1p32 / double(lattice_.step)),
                 row = std::int32_t(double(v) * 0x1p32 / double(lattice_.step));
      const float* weights = &footprint_.weights[std::size_t((u + v) % kPhases) * std::size_t(taps)];
      for (std::int32_t i = 0; i < k; ++i) along[std::size_t(i)] = weights[i * taps / k];
      for (std::int32_t j = 0; j < k; ++j) {
        float* out = &sheet_[4 * (std::size_t(row + j) * sheet_row + std::size_t(column))];
        for (std::int32_t i = 0; i < k; ++i) {
          const float weight = along[std::size_t(j)] * along[std::size_t(i)];
          for (std::int32_t c = 0; c < 4; ++c) out[4 * i + c] += weight * rgba[c];
        }
      }
    }
  }
  for (std::size_t y = 0; y < pixels; ++y) {
    for (std::size_t x = 0; x < pixels; ++x) {
      float* out = &accumulated_[4 * (y * pixels + x)];
      const float rest = 1 - out[3];
      for (std::size_t c = 0; c < 4; ++c) out[c] += rest * sheet_[4 * (y * sheet_row + x) + c];
    }
  }
}

}  // namespace slabstream
