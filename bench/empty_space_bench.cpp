// The cost of empty space: the paper's hollow sphere of 128^3 voxels alone, and in the middle of volumes of 256^3 and 512^3 voxels, at a
// zoom that shows it in the same size. From the second frame on; the counters of stages are milliseconds a frame.
#include <benchmark/benchmark.h>

#include <atomic>
#include <cstring>

#include "common/base/check.h"
#include "common/renderers/registry.h"
#include "common/volume/sphere.h"
#include "worker/renderers/renderer.h"

namespace slabstream {
namespace {

constexpr std::int32_t kObject = 128;

Volume Surround(const Volume& object, std::int32_t side) {
  Volume volume = object;
  volume.description.geometry.size = {side, side, side};
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), object.block.type);
  const std::int32_t border = (side - kObject) / 2;
  for (Index3 v; v.z < kObject; ++v.z) {
    for (v.y = 0; v.y < kObject; ++v.y) {
      std::memcpy(&volume.block.bytes[std::size_t(volume.block.Offset({border, v.y + border, v.z + border}))],
                  &object.block.bytes[std::size_t(object.block.Offset({0, v.y, v.z}))], std::size_t{kObject});
    }
  }
  return volume;
}

void EmptySpace(benchmark::State& state) {
  const auto side = std::int32_t(state.range(0));
  const RendererKind& kind = *Renderers()[std::size_t(state.range(1))];
  const Volume volume = Surround(MakeSphere({SphereClass::kHollow, kObject, 0.05}).value(), side);

  FrameSetup setup;
  setup.description = volume.description;
  setup.range = {0, 255};
  SetRenderer(kind, setup);
  setup.transfer.colors = {{0, {0, 0, 0}}, {128, {0.9F, 0.4F, 0.1F}}, {255, {0.2F, 0.5F, 0.9F}}};
  setup.transfer.opacities = {{0, 0, 0.5, 0}, {64, 0.05, 0.5, 0}, {255, 0.05, 0.5, 0}};
  ViewParameters view;
  view.azimuth_degrees = 30;
  view.elevation_degrees = 20;
  view.zoom = double(side) / kObject;
  CHECK(kind.SetView(view, {512, 512}, setup).ok());

  SlabData slab{BrickedVoxels(volume.block)};
  const std::unique_ptr<Renderer> renderer = MakeRenderer(kind);
  const std::atomic<bool> cancelled{false};
  const auto render = [&](RankReport& report) {
    benchmark::DoNotOptimize(renderer->Render(slab, volume.block.box, setup, {}, cancelled, report).value());
  };
  RankReport first, report;
  render(first);
  for (auto _ : state) {
    report.spans.clear();
    render(report);
  }
  const double frames = double(state.iterations()) * 1e6;
  state.counters["first_prepare"] = double(first.stage_ns[std::size_t(Stage::kPrepare)]) / 1e6;
  state.SetLabel(std::string(kind.name()));
  for (const Stage stage : kind.stages())
    state.counters[std::string(ToString(stage))] = double(report.stage_ns[std::size_t(stage)]) / frames;
  state.counters["slab_MB"] = double(slab.bytes()) / 1e6;
}
BENCHMARK(EmptySpace)
    ->ArgNames({"side", "renderer"})
    ->ArgsProduct({{128, 256, 512}, benchmark::CreateDenseRange(0, std::int64_t(Renderers().size()) - 1, 1)})
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
