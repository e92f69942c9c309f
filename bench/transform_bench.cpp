// The transform of all voxels of an N^3 volume (N = 200, as in the paper): by a matrix product a voxel, by the paper's running additions
// into stored coordinates, and as the splatting pipeline does it, fused with footprint positions, piece by piece in the first-level cache.
#include <benchmark/benchmark.h>

#include <array>

#include "worker/kernels/transform.h"

namespace slabstream {
namespace {

constexpr int kSide = 200;
constexpr std::int64_t kVoxels = std::int64_t{1} * kSide * kSide * kSide;

using Matrix = std::array<std::array<float, 4>, 3>;
constexpr Matrix kMatrix = {{{0.7F, -0.4F, 0.2F, 80.0F}, {0.1F, 0.6F, -0.7F, 150.0F}, {0.5F, 0.4F, 0.8F, 10.0F}}};

struct Points {
  Points() {
    for (auto& component : components) component.resize(std::size_t(kVoxels));
  }
  std::array<AlignedVector<float>, 3> components;
};

void BruteForceStored(benchmark::State& state) {
  Points points;
  for (auto _ : state) {
    std::size_t i = 0;
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x, ++i) {
          for (std::size_t c = 0; c < 3; ++c) {
            points.components[c][i] = kMatrix[c][0] * float(x) + kMatrix[c][1] * float(y) + kMatrix[c][2] * float(z) + kMatrix[c][3];
          }
        }
      }
    }
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kVoxels);
}
BENCHMARK(BruteForceStored)->Unit(benchmark::kMillisecond);

// Seed, voxel, beam and slice phases: every coordinate is the one before plus an increment.
void IncrementalStored(benchmark::State& state) {
  Points points;
  constexpr std::size_t kBeam = kSide, kSlice = std::size_t{kSide} * kSide;
  for (auto _ : state) {
    for (std::size_t c = 0; c < 3; ++c) {
      float* p = points.components[c].data();
      p[0] = kMatrix[c][3];
      for (std::size_t i = 1; i < kBeam; ++i) p[i] = p[i - 1] + kMatrix[c][0];
      for (std::size_t i = kBeam; i < kSlice; ++i) p[i] = p[i - kBeam] + kMatrix[c][1];
      for (std::size_t i = kSlice; i < std::size_t(kVoxels); ++i) p[i] = p[i - kSlice] + kMatrix[c][2];
    }
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kVoxels);
}
BENCHMARK(IncrementalStored)->Unit(benchmark::kMillisecond);

template <void (*kTransform)(Projection, VoxelBatch&)>
void Fused(benchmark::State& state) {
  const auto projection = Projection(state.range(0));
  const GaussianKernel kernel = MakeGaussianKernel(0.7);
  const std::array<VoxelRecord, kFootprintCell> records{};
  VoxelBatch batch;
  for (auto _ : state) {
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; x += kFootprintCell) {
          BeamPiece piece;
          piece.count = std::min(kFootprintCell, kSide - x);
          piece.mask = std::uint32_t((std::uint64_t{1} << piece.count) - 1);
          piece.records = records.data();
          piece.kernel_x = piece.kernel_y = &kernel;
          piece.x0 = kMatrix[0][0] * float(x) + kMatrix[0][1] * float(y) + kMatrix[0][2] * float(z);
          piece.y0 = kMatrix[1][0] * float(x) + kMatrix[1][1] * float(y) + kMatrix[1][2] * float(z);
          piece.x_step = kMatrix[0][0];
          piece.y_step = kMatrix[1][0];
          piece.w_step = 1e-4F;
          if (batch.voxel_count + std::size_t(piece.count) > VoxelBatch::kVoxels) {
            kTransform(projection, batch);
            batch.pieces.clear();
            batch.voxel_count = 0;
          }
          batch.pieces.push_back(piece);
          batch.voxel_count += std::size_t(piece.count);
        }
      }
    }
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kVoxels);
  state.SetLabel(projection == Projection::kPerspective ? "perspective" : "orthographic");
}
BENCHMARK(Fused<TransformPieces>)->Name("IncrementalFused")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(Fused<TransformPiecesReference>)->Name("IncrementalFusedReference")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
