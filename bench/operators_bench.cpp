// The image operators on 512 x 512 pixels: over on rows (vectors and reference), whole images by over and by nearest depth, and the picture
// from a frame of splatting.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/kernels/combine.h"
#include "common/kernels/resample.h"

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

template <bool (*kOver)(const float*, const float*, float*, std::size_t)>
void Over(benchmark::State& state) {
  const LocalImage front = Filled(PixelFormat::kRgba, 0.3F);
  LocalImage back = Filled(PixelFormat::kRgba, 0.6F);
  for (auto _ : state) {
    CHECK(kOver(front.rgba.data(), back.rgba.data(), back.rgba.data(), std::size_t(kPixels)));
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
}
BENCHMARK(Over<OverRow>)->Name("OverRows")->Unit(benchmark::kMicrosecond);
BENCHMARK(Over<OverRowReference>)->Name("OverRowsReference")->Unit(benchmark::kMicrosecond);

template <bool kUnchecked>
void CombineImages(benchmark::State& state) {
  const auto format = PixelFormat(state.range(0));
  const LocalImage other = Filled(format, 0.3F);
  const ImageView view = ViewOf(other);
  LocalImage image = Filled(format, 0.6F);
  for (auto _ : state) {
    if constexpr (kUnchecked) {
      CHECK(CombineUnchecked(image, view, Side::kBack, image.bounds));
    } else {
      Combine(image, view, Side::kBack, image.bounds);
    }
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
  state.SetLabel(format == PixelFormat::kRgba ? "over" : "nearest depth");
}
BENCHMARK(CombineImages<false>)->Name("CombineImages")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);
BENCHMARK(CombineImages<true>)->Name("CombineUncheckedImages")->Arg(1)->Arg(2)->Unit(benchmark::kMicrosecond);

// A picture from a frame of about as many pixels, rotated and skewed as by an oblique view, 16 rows a call.
template <void (*kResample)(const LocalImage&, const ProjectiveMap&, std::int32_t, std::int32_t, LocalImage&)>
void Resample(benchmark::State& state) {
  const LocalImage frame = Filled(PixelFormat::kRgba, 0.3F);
  LocalImage picture = Filled(PixelFormat::kRgba, 0);
  const double scale = double(state.range(0)) / 100, c = 0.9 * scale, s = 0.43 * scale;
  const ProjectiveMap map = {c, -s, 256 - 256 * (c - s), s, c, 256 - 256 * (c + s), 0, 0, 1};
  for (auto _ : state) {
    for (std::int32_t y = 0; y < kSide; y += 16) kResample(frame, map, y, y + 16, picture);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPixels);
}
BENCHMARK(Resample<ResampleRows>)->Name("Resample")->ArgName("scale_percent")->Arg(50)->Arg(100)->Arg(400)->Unit(benchmark::kMicrosecond);
BENCHMARK(Resample<ResampleRowsReference>)
    ->Name("ResampleReference")
    ->ArgName("scale_percent")
    ->Arg(50)
    ->Arg(100)
    ->Arg(400)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace slabstream
