// The paper's table 1: the transform of all voxels of an N^3 volume (N = 200 and 300) by a matrix product for each voxel against running
// additions; scalar and in vectors, into stored coordinates and fused with their use. And what the splatting pipeline does instead:
// fixed-point positions along one dimension (Lattice), for which a beam is filtered.
#include <benchmark/benchmark.h>

#include "laboratory/measure/transform_loops.h"
#include "worker/kernels/footprint_table.h"

namespace slabstream::bench {
namespace {

constexpr TransformMatrix kMatrix = {{{0.7F, -0.4F, 0.2F, 80.0F}, {0.1F, 0.6F, -0.7F, 150.0F}, {0.5F, 0.4F, 0.8F, 10.0F}}};

void CountVoxels(benchmark::State& state, std::int64_t side) {
  const std::int64_t voxels = side * side * side;
  state.SetItemsProcessed(state.iterations() * voxels);
  state.counters["ns_a_voxel"] =
      benchmark::Counter(double(state.iterations() * voxels) * 1e-9, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

template <void (*kStore)(const TransformMatrix&, const Index3&, TransformedPoints&)>
void Stored(benchmark::State& state) {
  const auto side = int(state.range(0));
  const Index3 cube = {side, side, side};
  TransformedPoints points(cube);
  for (auto _ : state) {
    kStore(kMatrix, cube, points);
    benchmark::ClobberMemory();
  }
  CountVoxels(state, side);
}

template <std::uint32_t (*kFuse)(const TransformMatrix&, const Index3&)>
void Fused(benchmark::State& state) {
  const auto side = int(state.range(0));
  const Index3 cube = {side, side, side};
  for (auto _ : state) benchmark::DoNotOptimize(kFuse(kMatrix, cube));
  CountVoxels(state, side);
}

// All voxels of the volume occupied, a pixel a voxel: a lattice for each slice, and the first tap and the phase of each sample of each
// beam.
void InTheRenderPath(benchmark::State& state) {
  const auto side = int(state.range(0));
  for (auto _ : state) {
    std::size_t used = 0;
    for (int slice = 0; slice < side; ++slice) {
      const Lattice columns = MakeLattice(0.98, 0.31 * slice, 1.8), rows = MakeLattice(0.98, 0.17 * slice, 1.8);
      used ^= std::size_t(rows.start);
      for (int beam = 0; beam < side; ++beam) {
        std::int64_t at = columns.start + beam;
        for (int sample = 0; sample < side; ++sample, at += columns.step) used ^= std::size_t(Lattice::First(at)) + Lattice::Phase(at);
      }
    }
    benchmark::DoNotOptimize(used);
  }
  CountVoxels(state, side);
}

void Sides(benchmark::internal::Benchmark* bench) { bench->ArgName("N")->Arg(200)->Arg(300)->Unit(benchmark::kMillisecond); }

BENCHMARK(Stored<StoreProductScalar>)->Name("Product/stored/scalar")->Apply(Sides);
BENCHMARK(Stored<StoreIncrementsScalar>)->Name("Increments/stored/scalar")->Apply(Sides);
BENCHMARK(Stored<StoreProductVector>)->Name("Product/stored/vector")->Apply(Sides);
BENCHMARK(Stored<StoreIncrementsVector>)->Name("Increments/stored/vector")->Apply(Sides);
BENCHMARK(Fused<FuseProductScalar>)->Name("Product/fused/scalar")->Apply(Sides);
BENCHMARK(Fused<FuseIncrementsScalar>)->Name("Increments/fused/scalar")->Apply(Sides);
BENCHMARK(Fused<FuseProductVector>)->Name("Product/fused/vector")->Apply(Sides);
BENCHMARK(Fused<FuseIncrementsVector>)->Name("Increments/fused/vector")->Apply(Sides);
BENCHMARK(InTheRenderPath)->Apply(Sides);

}  // namespace
}  // namespace slabstream::bench
