// The splat stage: voxels a second by instruction set and footprint width, against the plain loop. Voxels lie in scan order, one pixel
// apart.
#include <benchmark/benchmark.h>

#include <hwy/highway.h>

#include <array>
#include <bit>
#include <cmath>

#include "worker/kernels/splat.h"
#include "worker/kernels/transform.h"

namespace slabstream {
namespace {

constexpr std::int32_t kSide = 520;  // pixels: an odd number of tiles, as sheets have (splatting/sheet.cpp)

struct Scene {
  explicit Scene(double sigma) : kernel(MakeGaussianKernel(sigma)), sheet(4 * std::size_t(kSide) * kSide) {
    for (std::int32_t i = 0; i < 32; ++i) {
      BeamPiece piece;
      piece.mask = 0xFFFFFFFF;
      piece.count = 32;
      piece.records = records.data();
      piece.kernel_x = piece.kernel_y = &kernel;
      piece.x_step = 0.9F;
      piece.y_step = 0.2F;
      piece.column = 40 + 28 * (i % 8);
      piece.row = 40 + 8 * (i / 8);
      batch.pieces.push_back(piece);
    }
    batch.voxel_count = 1024;
    TransformPieces(Projection::kOrthographic, batch);
    for (std::size_t i = 0; i < 4 * batch.voxel_count; ++i) batch.rgba[i] = 0.25F;
  }
  SheetView view() { return {sheet.data(), kSide, kSide}; }

  GaussianKernel kernel;
  std::array<VoxelRecord, 32> records{};
  VoxelBatch batch;
  AlignedVector<float> sheet;
};

void Splat(benchmark::State& state) {
  Scene scene(double(state.range(0)) / 100);
  for (auto _ : state) SplatPieces(scene.batch, scene.view());
  state.SetItemsProcessed(state.iterations() * std::int64_t(scene.batch.voxel_count));
  state.SetLabel(std::to_string(scene.kernel.taps) + " taps, " +
                 hwy::TargetName(std::int64_t(1) << std::countr_zero(std::uint64_t(hwy::SupportedTargets()))));
}
BENCHMARK(Splat)->ArgName("sigma_percent")->Arg(54)->Arg(70)->Arg(100)->Arg(330);

void SplatReference(benchmark::State& state) {
  Scene scene(double(state.range(0)) / 100);
  for (auto _ : state) SplatPiecesReference(scene.batch, scene.view());
  state.SetItemsProcessed(state.iterations() * std::int64_t(scene.batch.voxel_count));
}
BENCHMARK(SplatReference)->ArgName("sigma_percent")->Arg(54)->Arg(70)->Arg(330);

}  // namespace
}  // namespace slabstream
