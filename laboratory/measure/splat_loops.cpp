#include "laboratory/measure/splat_loops.h"

#include <algorithm>
#include <random>

#include "worker/kernels/splat.h"

namespace slabstream {
namespace {

constexpr std::int32_t kMargin = 48;    // empty voxels on both sides of a beam: more than any footprint and its padding
constexpr std::int32_t kBandRows = 48;  // as in the pipeline
constexpr std::size_t kRoom = 64;       // floats behind the last row

}  // namespace

// The first sample's first tap lies k or k - 1 voxels before the slice: the first voxel's footprint begins at pixel 0 or 1.
DenseSlice::DenseSlice(std::int32_t side, double sigma, double occupancy, std::uint64_t seed)
    : side_(side),
      footprint_(MakeFootprintTable(sigma, 3)),
      lattice_(MakeLattice(1, footprint_.radius + 1.3, footprint_.radius)),
      pixels_((side + footprint_.taps + kSegment) / kSegment * kSegment),
      row_voxels_(side + 2 * kMargin),
      voxels_(4 * std::size_t(row_voxels_) * std::size_t(side) + kRoom),
      accumulated_(4 * std::size_t(pixels_) * std::size_t(pixels_)),
      filtered_(4 * std::size_t(pixels_) * (2 * kBandRows + 2 * kMargin)),
      sheet_(accumulated_.size() + kRoom),
      words_(SegmentWords(pixels_ / kSegment)),
      all_(std::size_t(words_)),
      open_(std::size_t(words_)) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution occupied(occupancy);
  std::uniform_real_distribution<float> shade(0.005F, 0.015F);
  for (std::int32_t v = 0; v < side_; ++v) {
    for (std::int32_t u = 0; u < side_; ++u) {
      if (occupied(random)) std::generate_n(&voxels_[VoxelAt(u, v)], 4, [&] { return shade(random); });
    }
  }
  // Pixels gather: tap n of a pixel is the voxel First + n. So a voxel's first pixel gets its last tap.
  const auto taps = std::size_t(footprint_.taps);
  const float* last = &footprint_.weights[(Lattice::Phase(lattice_.At(0)) + 1) * taps - 1];
  for (std::size_t j = 0; j < taps; ++j) {
    for (std::size_t i = 0; i < taps; ++i) square_.push_back(*(last - j) * *(last - i));
  }
  Insert(all_.data(), 0, pixels_ / kSegment);
}

std::size_t DenseSlice::VoxelAt(std::int32_t u, std::int32_t v) const { return 4 * std::size_t(v * row_voxels_ + kMargin + u); }

std::size_t DenseSlice::SheetAt(std::int32_t u, std::int32_t v) const {
  const std::int32_t first = 1 - footprint_.taps - Lattice::First(lattice_.At(0));
  return 4 * std::size_t((v + first) * pixels_ + u + first);
}

void DenseSlice::SplatPlainly() {
  std::ranges::fill(sheet_, 0.0F);
  AddEachVoxel();
  CompositeSheet();
}

void DenseSlice::SplatInPhases() {
  std::ranges::fill(sheet_, 0.0F);
  SpreadInPhases({&voxels_[VoxelAt(0, 0)], 4 * std::size_t(row_voxels_), &sheet_[SheetAt(0, 0)], 4 * std::size_t(pixels_),
                  4 * std::size_t(side_), side_, footprint_.taps, square_.data()});
  CompositeSheet();
}

void DenseSlice::CompositeSheet() {
  for (std::size_t i = 0; i < accumulated_.size(); i += 4) {
    const float rest = 1 - accumulated_[i + 3];
    for (std::size_t c = 0; c < 4; ++c) accumulated_[i + c] += rest * sheet_[i + c];
  }
}

void DenseSlice::SplatByKernels() {
  const std::int32_t taps = footprint_.taps;
  const std::size_t row_floats = 4 * std::size_t(pixels_);
  std::vector<const float*> beams(static_cast<std::size_t>(taps));
  const std::vector<const SegmentWord*> filled(std::size_t(taps), all_.data());
  const std::vector<float> never(std::size_t(words_) * std::size_t{kWordSegments}, 2.0F);  // alpha that no segment reaches
  for (std::int32_t band = 0; band < pixels_; band += kBandRows) {
    const std::int32_t end = std::min(band + kBandRows, pixels_);
    const std::int32_t first_beam = Lattice::First(lattice_.At(band)), last = Lattice::First(lattice_.At(end - 1)) + taps;
    for (std::int32_t beam = std::max(first_beam, 0); beam < std::min(last, side_); ++beam) {
      FilterBeam(footprint_, lattice_,
                 {&voxels_[VoxelAt(0, beam)], &filtered_[std::size_t(beam - first_beam) * row_floats], all_.data(), words_, 0});
    }
    for (std::int32_t row = band; row < end; ++row) {
      const std::int64_t at = lattice_.At(row);
      const std::int32_t first = std::max(Lattice::First(at), 0), count = std::min(Lattice::First(at) + taps, side_) - first;
      if (count <= 0) continue;
      for (std::int32_t n = 0; n < count; ++n) beams[std::size_t(n)] = &filtered_[std::size_t(first + n - first_beam) * row_floats];
      std::ranges::copy(all_, open_.begin());
      const float* weights = &footprint_.weights[Lattice::Phase(at) * std::size_t(taps) + std::size_t(first - Lattice::First(at))];
      CompositeRow(
          {count, weights, beams.data(), filled.data(), &accumulated_[std::size_t(row) * row_floats], open_.data(), words_, never.data()});
    }
  }
}

}  // namespace slabstream
