// Counting the occupied voxels of 512^3 (8 bits): noise, of which every row must be searched, and the paper's hollow sphere, whole and by
// bricks.
#include <benchmark/benchmark.h>

#include "common/classification/count_occupied.h"
#include "common/volume/sphere.h"

namespace slabstream {
namespace {

constexpr int kSide = 512;

ClassificationTable Table(const VolumeDescription& description) {
  TransferFunction transfer;
  transfer.colors = {{0, {1, 1, 1}}};
  transfer.opacities = {{0, 0, 0.5, 0}, {64, 0.05, 0.5, 0}, {255, 0.05, 0.5, 0}};
  return Classify(transfer, description, {0, 255});
}

template <class Voxels>
void Run(benchmark::State& state, const Voxels& voxels, const ClassificationTable& table) {
  for (auto _ : state) benchmark::DoNotOptimize(CountOccupied(voxels, table).cells.data());
}

void CountNoise(benchmark::State& state) {
  VolumeDescription description;
  description.geometry.size = {kSide, kSide, kSide};
  VoxelBlock block = MakeVoxelBlock(description.geometry.bounds(), ScalarType::kUint8);
  std::uint32_t x = 1;
  for (std::byte& sample : block.bytes) {
    x = x * 1664525 + 1013904223;
    sample = std::byte(x >> 24);
  }
  Run(state, block, Table(description));
}

void CountSphere(benchmark::State& state) {
  const Volume volume = MakeSphere({SphereClass::kHollow, kSide, 0.05}).value();
  const ClassificationTable table = Table(volume.description);
  if (state.range(0) != 0) {
    Run(state, BrickedVoxels(volume.block), table);
  } else {
    Run(state, volume.block, table);
  }
}

BENCHMARK(CountNoise)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(CountSphere)->ArgName("bricks")->Arg(0)->Arg(1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
