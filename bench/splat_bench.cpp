// Splatting and compositing of a dense slice, 256 x 256 shaded voxels at a pixel a voxel: the kernels of the pipeline beside the plain
// loop, which is compiled without vectors. `ratio`: how many times faster the kernels are.
#include <benchmark/benchmark.h>

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <vector>

#include "laboratory/measure/splat_loops.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {
namespace {

constexpr std::int32_t kVoxels = 256;  // a side of the slice

void SplatSlice(benchmark::State& state) {
  DenseSlice slice(kVoxels, double(state.range(0)) / 100);
  // The plain loop first.
  std::vector<double> plain;
  for (int i = 0; i < 7; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    slice.SplatPlainly();
    benchmark::DoNotOptimize(slice.accumulated().data());
    plain.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  }
  const double plain_seconds = MedianOf(std::move(plain)).median;

  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) {
    slice.SplatByKernels();
    benchmark::ClobberMemory();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / double(state.iterations());
  constexpr double kCount = double(kVoxels) * kVoxels;
  state.SetItemsProcessed(state.iterations() * std::int64_t(kCount));
  state.counters["plain_voxels_per_second"] = kCount / plain_seconds;
  state.counters["ratio"] = plain_seconds / seconds;
  state.SetLabel(std::to_string(slice.taps()) + " taps, " +
                 hwy::TargetName(std::int64_t(1) << std::countr_zero(std::uint64_t(hwy::SupportedTargets()))));
}
BENCHMARK(SplatSlice)->Name("DenseSlice")->ArgName("sigma_percent")->Arg(60)->Arg(80)->Arg(100)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace slabstream
