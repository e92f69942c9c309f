// Stage times of whole renderings on one thread: the paper's two spheres at N = 200, as one box and as two boxes one after the other (p =
// 1, 2), both pipelines, from the second frame on. Counters are milliseconds a frame, summed over boxes; `finish` is making the picture
// from the frame.
#include <benchmark/benchmark.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>

#include "common/base/check.h"
#include "common/decomposition/decomposition.h"
#include "common/renderers/registry.h"
#include "common/volume/sphere.h"
#include "worker/renderers/renderer.h"

namespace slabstream {
namespace {

constexpr int kSide = 200;

void Stages(benchmark::State& state) {
  const auto sphere = SphereClass(state.range(0));
  const auto boxes = int(state.range(1));
  const RendererKind& kind = *Renderers()[std::size_t(state.range(2))];
  const Volume volume = MakeSphere({sphere, kSide, sphere == SphereClass::kHollow ? 0.05 : 0.40}).value();
  const VolumeSummary summary = Summarize(volume);

  FrameSetup setup;
  setup.description = volume.description;
  setup.range = summary.range;
  SetRenderer(kind, setup);
  setup.transfer.colors = {{0, {0, 0, 0}}, {128, {0.9F, 0.4F, 0.1F}}, {255, {0.2F, 0.5F, 0.9F}}};
  setup.transfer.opacities = {{0, 0, 0.5, 0}, {64, 0.05, 0.5, 0}, {255, 0.05, 0.5, 0}};
  ViewParameters view;
  view.azimuth_degrees = 30;
  view.elevation_degrees = 20;
  const VolumeGeometry& geometry = volume.description.geometry;
  CHECK(kind.SetView(view, {512, 512}, setup).ok());

  const WorkField voxels = WorkField::Uniform(geometry.size);
  const Partition partition = MakeSlabs({.work = &voxels, .boxes = boxes});
  std::vector<std::unique_ptr<SlabData>> slabs;
  for (const Box& box : partition.boxes()) {
    slabs.push_back(std::make_unique<SlabData>(CutBlock(volume.block, SlabBox(box, setup))));
  }

  const std::unique_ptr<Renderer> renderer = MakeRenderer(kind);
  const std::atomic<bool> cancelled{false};
  tbb::task_arena one_thread(1);
  std::chrono::duration<double, std::milli> finish{};
  const auto render = [&](RankReport& report) {
    one_thread.execute([&] {
      LocalImage frame;
      for (std::size_t i = 0; i < slabs.size(); ++i) {
        frame = renderer->Render(*slabs[i], partition.boxes()[i], setup, {}, cancelled, report).value();
        benchmark::DoNotOptimize(frame.rgba.data());
      }
      const auto begin = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(kind.Finish(frame, setup));
      finish += std::chrono::steady_clock::now() - begin;
    });
  };
  RankReport first, report;
  render(first);
  finish = {};
  for (auto _ : state) {
    report.spans.clear();
    render(report);
  }
  const double frames = double(state.iterations()) * 1e6;
  state.counters["first_prepare"] = double(first.stage_ns[std::size_t(Stage::kPrepare)]) / 1e6;
  state.SetLabel(std::string(kind.name()));
  for (const Stage stage : kind.stages())
    state.counters[std::string(ToString(stage))] = double(report.stage_ns[std::size_t(stage)]) / frames;
  state.counters["finish"] = finish.count() / double(state.iterations());
  state.counters["voxels"] = double(first.drawn_voxels);
}
BENCHMARK(Stages)->ArgNames({"class", "p", "renderer"})->ArgsProduct({{1, 2}, {1, 2}, {1, 2}})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
