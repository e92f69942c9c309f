// Frames of the Z-buffer, from the second on: the paper's hollow sphere with N = 200 and 256 at 512 x 512, 12 azimuths one after the other,
// by 1 and 2 threads. Time is per frame; counters are milliseconds a frame, summed over threads.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <atomic>

#include "common/renderers/registry.h"
#include "common/volume/sphere.h"
#include "worker/renderers/renderer.h"

namespace slabstream {
namespace {

constexpr int kAzimuths = 12;

void Frame(benchmark::State& state) {
  const Volume volume = MakeSphere({SphereClass::kHollow, int(state.range(0)), 0.05}).value();
  tbb::task_arena threads(int(state.range(2)));
  std::vector<FrameSetup> setups;
  for (int i = 0; i < kAzimuths; ++i) {
    FrameSetup setup;
    setup.description = volume.description;
    setup.range = Summarize(volume).range;
    SetRenderer(*FindRenderer("zbuffer"), setup);
    setup.transfer.colors = {{0, {0, 0, 0}}, {128, {0.9F, 0.4F, 0.1F}}, {255, {0.2F, 0.5F, 0.9F}}};
    setup.transfer.opacities = {{0, 0, 0.5, 0}, {64, 0.9, 0.5, 0}, {255, 0.9, 0.5, 0}};
    ViewParameters view;
    view.projection = Projection(state.range(1));
    view.azimuth_degrees = i * 360.0 / kAzimuths;
    view.elevation_degrees = 20;
    view.zoom = 1.732;
    view.fov_degrees = 30;
    setup.camera = MakeCamera(view, {512, 512}, volume.description.geometry);
    setups.push_back(std::move(setup));
  }

  VoxelBlock copy = MakeVoxelBlock(volume.block.box, volume.block.type);
  copy.bytes = volume.block.bytes;
  SlabData slab(std::move(copy));
  const std::unique_ptr<Renderer> renderer = MakeRenderer(*FindRenderer("zbuffer"));
  const std::atomic<bool> cancelled{false};
  std::size_t frame = 0;
  const auto render = [&](RankReport& report) {
    threads.execute([&] {
      const FrameSetup& setup = setups[frame++ % kAzimuths];
      benchmark::DoNotOptimize(renderer->Render(slab, volume.block.box, setup, {}, cancelled, report).value());
    });
  };
  RankReport first, report;
  render(first);
  for (auto _ : state) {
    report.spans.clear();
    render(report);
  }
  const double frames = double(state.iterations());
  state.counters["first_prepare"] = double(first.stage_ns[std::size_t(Stage::kPrepare)]) / 1e6;
  for (Stage stage : {Stage::kPrepare, Stage::kZBuffer, Stage::kShade}) {
    state.counters[std::string(ToString(stage))] = double(report.stage_ns[std::size_t(stage)]) / 1e6 / frames;
  }
  state.counters["faces"] = double(report.drawn_voxels) / frames;
  state.counters["slab_MB"] = double(slab.bytes()) / 1e6;
}
BENCHMARK(Frame)
    ->ArgNames({"N", "projection", "threads"})
    ->ArgsProduct({{200, 256}, {int(Projection::kOrthographic), int(Projection::kPerspective)}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
