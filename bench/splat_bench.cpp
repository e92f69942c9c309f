// Splatting and compositing of a dense slice, 256 x 256 shaded voxels into a frame: the kernels of the pipeline, band by band as it runs
// them, beside what they replace, a loop that adds k x k weighted pixels into a sheet for each voxel and then composites the sheet.
// `ratio`: how many times faster the kernels are.
#include <benchmark/benchmark.h>

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <vector>

#include "worker/kernels/splat.h"

namespace slabstream {
namespace {

constexpr std::int32_t kVoxels = 256;   // a side of the slice
constexpr std::int32_t kMargin = 32;    // empty voxels on both sides of a beam
constexpr std::int32_t kBandRows = 48;  // as in the pipeline
constexpr std::int32_t kRowVoxels = kVoxels + 2 * kMargin;

struct Slice {
  Slice(double sigma, double scale)
      : footprint(MakeFootprintTable(sigma, 3)),
        pixels((std::int32_t(kVoxels * scale) + 16) / kSegment * kSegment),
        lattice(MakeLattice(scale, 4.3, footprint.radius)),
        voxels(4 * std::size_t{kRowVoxels} * kVoxels),
        accumulated(4 * std::size_t(pixels) * std::size_t(pixels)),
        words(SegmentWords(pixels / kSegment)),
        all(std::size_t(words)) {
    for (std::size_t row = 0; row < kVoxels; ++row) std::fill_n(&voxels[4 * (row * kRowVoxels + kMargin)], 4 * kVoxels, 0.01F);
    Insert(all.data(), 0, pixels / kSegment);
  }
  FootprintTable footprint;
  std::int32_t pixels;  // a side of the frame
  Lattice lattice;      // along both axes
  AlignedVector<float> voxels, accumulated;
  std::int32_t words;
  std::vector<SegmentWord> all;  // every segment of a row
};

void SplatByKernels(Slice& slice, AlignedVector<float>& filtered, std::vector<SegmentWord>& open) {
  const std::int32_t taps = slice.footprint.taps;
  const std::size_t row_floats = 4 * std::size_t(slice.pixels);
  std::vector<const float*> beams(static_cast<std::size_t>(taps));
  const std::vector<const SegmentWord*> filled(std::size_t(taps), slice.all.data());
  for (std::int32_t band = 0; band < slice.pixels; band += kBandRows) {
    const std::int32_t end = std::min(band + kBandRows, slice.pixels);
    const std::int32_t first_beam = Lattice::First(slice.lattice.At(band)), last = Lattice::First(slice.lattice.At(end - 1)) + taps;
    for (std::int32_t beam = std::max(first_beam, 0); beam < std::min(last, kVoxels); ++beam) {
      FilterBeam(slice.footprint, slice.lattice,
                 {&slice.voxels[4 * (std::size_t(beam) * kRowVoxels + kMargin)], &filtered[std::size_t(beam - first_beam) * row_floats],
                  slice.all.data(), slice.words, 0});
    }
    for (std::int32_t row = band; row < end; ++row) {
      const std::int64_t at = slice.lattice.At(row);
      const std::int32_t first = std::max(Lattice::First(at), 0), count = std::min(Lattice::First(at) + taps, kVoxels) - first;
      if (count <= 0) continue;
      for (std::int32_t n = 0; n < count; ++n) beams[std::size_t(n)] = &filtered[std::size_t(first + n - first_beam) * row_floats];
      std::ranges::copy(slice.all, open.begin());
      const float* weights = &slice.footprint.weights[Lattice::Phase(at) * std::size_t(taps) + std::size_t(first - Lattice::First(at))];
      CompositeRow(
          {count, weights, beams.data(), filled.data(), &slice.accumulated[std::size_t(row) * row_floats], open.data(), slice.words, 2});
    }
  }
}

// One voxel after the other, by a table of its footprint's weights as above.
void SplatPlainly(Slice& slice, AlignedVector<float>& sheet) {
  const std::int32_t taps = slice.footprint.taps, k = std::int32_t(taps * 0x1p32 / double(slice.lattice.step) + 0.5);
  const auto pixels = std::size_t(slice.pixels);
  std::ranges::fill(sheet, 0.0F);
  std::vector<float> along(static_cast<std::size_t>(k));
  for (std::int32_t v = 0; v < kVoxels; ++v) {
    for (std::int32_t u = 0; u < kVoxels; ++u) {
      const float* rgba = &slice.voxels[4 * (std::size_t(v) * kRowVoxels + kMargin + std::size_t(u))];
      const auto column = std::int32_t(double(u) * 0x1p32 / double(slice.lattice.step)),
                 row = std::int32_t(double(v) * 0x1p32 / double(slice.lattice.step));
      const float* weights = &slice.footprint.weights[std::size_t((u + v) % kPhases) * std::size_t(taps)];
      for (std::int32_t i = 0; i < k; ++i) along[std::size_t(i)] = weights[i * taps / k];
      for (std::int32_t j = 0; j < k; ++j) {
        float* out = &sheet[4 * (std::size_t(row + j) * pixels + std::size_t(column))];
        for (std::int32_t i = 0; i < k; ++i) {
          const float weight = along[std::size_t(j)] * along[std::size_t(i)];
          for (std::int32_t c = 0; c < 4; ++c) out[4 * i + c] += weight * rgba[c];
        }
      }
    }
  }
  for (std::size_t p = 0; p < pixels * pixels; ++p) {
    const float rest = 1 - slice.accumulated[4 * p + 3];
    for (std::size_t c = 0; c < 4; ++c) slice.accumulated[4 * p + c] += rest * sheet[4 * p + c];
  }
}

void DenseSlice(benchmark::State& state) {
  Slice slice(double(state.range(0)) / 100, double(state.range(1)));
  AlignedVector<float> filtered(4 * std::size_t(slice.pixels) * (kBandRows + 32)),
      sheet(4 * std::size_t(slice.pixels + 16) * std::size_t(slice.pixels));
  std::vector<SegmentWord> open(slice.all);
  // The plain loop first: the median of some runs.
  std::vector<double> plain;
  for (int i = 0; i < 7; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    SplatPlainly(slice, sheet);
    benchmark::DoNotOptimize(slice.accumulated.data());
    plain.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  std::ranges::nth_element(plain, plain.begin() + 3);

  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) {
    SplatByKernels(slice, filtered, open);
    benchmark::ClobberMemory();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / double(state.iterations());
  constexpr double kCount = double(kVoxels) * kVoxels;
  state.SetItemsProcessed(state.iterations() * std::int64_t(kCount));
  state.counters["plain_voxels_per_second"] = kCount / plain[3];
  state.counters["ratio"] = plain[3] / seconds;
  state.SetLabel(std::to_string(slice.footprint.taps) + " taps, " +
                 hwy::TargetName(std::int64_t(1) << std::countr_zero(std::uint64_t(hwy::SupportedTargets()))));
}
BENCHMARK(DenseSlice)
    ->ArgNames({"sigma_percent", "pixels_a_voxel"})
    ->Args({60, 1})
    ->Args({80, 1})
    ->Args({100, 1})
    ->Args({60, 2})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace slabstream
