// The image operators on 512 x 512 pixels: over on rows (vectors and reference), sheets into the image (splatting), whole images by over
// and by nearest depth.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "common/kernels/combine.h"
#include "worker/kernels/composite.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 512;
constexpr std::int64_t kPixels = std::int64_t{kSide} * kSide;

LocalImage Filled(PixelFormat format, float alpha) {
  LocalImage image = MakeLocalImage(format, {0, 0, kSide, kSide});
  std::ranges::fill(image.rgba, alpha);
  for (std::size_t i = 0; i < image.depth.size(); ++i) {
    image.depth[i] = float(i * 2654435761U % 1000);
    image.voxel[i] = std::uint32_t(i);
  }
  return image;
}

template <void (*kOver)(const float*, const float*, float*, std::size_t)>
void Over(benchmark::State& state) {
  const LocalImage front = Filled(PixelFormat::kRgba, 0.3F);
  LocalImage back = Filled(PixelFormat::kRgba, 0.6F);
  for (auto _ : state) {
    kOver(front.rgba.data(), back.rgba.data(), back.rgba.data(), std::size_t(kPixels));
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
}
BENCHMARK(Over<OverRow>)->Name("OverRows")->Unit(benchmark::kMicrosecond);
BENCHMARK(Over<OverRowReference>)->Name("OverRowsReference")->Unit(benchmark::kMicrosecond);

void CombineImages(benchmark::State& state) {
  const auto format = PixelFormat(state.range(0));
  const LocalImage other = Filled(format, 0.3F);
  LocalImage image = Filled(format, 0.6F);
  for (auto _ : state) {
    Combine(image, other, Side::kBack);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
  state.SetLabel(format == PixelFormat::kRgba ? "over" : "nearest depth");
}
BENCHMARK(CombineImages)->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);

template <float (*kComposite)(const TileWork&)>
void CompositeSheet(benchmark::State& state) {
  AlignedVector<float> sheet(4 * std::size_t(kPixels)), accumulated(4 * std::size_t(kPixels));
  const AlignedVector<float> ratio(std::size_t(kPixels), 1.1F);
  for (auto _ : state) {
    for (std::int32_t y = 0; y < kSide; y += kTile) {
      for (std::int32_t x = 0; x < kSide; x += kTile) {
        const std::size_t pixel = std::size_t(y) * kSide + std::size_t(x);
        TileWork tile;
        tile.sheet = &sheet[4 * pixel];
        tile.accumulated = &accumulated[4 * pixel];
        tile.row_pixels = kSide;
        if (state.range(0) == 2) tile.distance_ratio = &ratio[pixel];
        for (int j = 0; j < kTile; ++j) std::fill_n(tile.sheet + std::size_t(j) * 4 * kSide, 4 * kTile, 0.01F);
        benchmark::DoNotOptimize(kComposite(tile));
      }
    }
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
  state.SetLabel(state.range(0) == 2 ? "perspective" : "orthographic");
}
BENCHMARK(CompositeSheet<CompositeTile>)->Name("CompositeSheet")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK(CompositeSheet<CompositeTileReference>)->Name("CompositeSheetReference")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace slabstream
