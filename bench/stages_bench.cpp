// Stage times of whole renderings: the paper's two spheres at N = 200, as one box and as two boxes one after the other (p = 1, 2), both
// pipelines, second frame on. Counters are milliseconds a frame, summed over boxes.
#include <benchmark/benchmark.h>

#include <atomic>
#include <cstring>

#include "common/decomposition/decomposition.h"
#include "common/volume/sphere.h"
#include "worker/render/pipeline.h"

namespace slabstream {
namespace {

constexpr int kSide = 200;

void Stages(benchmark::State& state) {
  const auto sphere = SphereClass(state.range(0));
  const auto boxes = int(state.range(1));
  const auto renderer_kind = RendererKind(state.range(2));
  const Volume volume = MakeSphere({sphere, kSide, sphere == SphereClass::kHollow ? 0.05 : 0.40}).value();
  const VolumeSummary summary = Summarize(volume);

  FrameSetup setup;
  setup.description = volume.description;
  setup.range = summary.range;
  setup.renderer = renderer_kind;
  setup.transfer.colors = {{0, {0, 0, 0}}, {128, {0.9F, 0.4F, 0.1F}}, {255, {0.2F, 0.5F, 0.9F}}};
  setup.transfer.opacities = {{0, 0, 0.5, 0}, {64, 0.05, 0.5, 0}, {255, 0.05, 0.5, 0}};
  ViewParameters view;
  view.azimuth_degrees = 30;
  view.elevation_degrees = 20;
  setup.camera = MakeCamera(view, {512, 512}, volume.description.geometry);
  setup.halo = RequiredHalo(setup.camera, volume.description.geometry);

  DecompositionRequest request;
  request.summary = &summary;
  request.boxes = boxes;
  const Partition partition = MakeSlabs(request);
  std::vector<std::unique_ptr<SlabData>> slabs;
  for (const Box& box : partition.boxes()) {
    VoxelBlock block = MakeVoxelBlock(SlabBox(box, setup), volume.description.type);
    // Slabs along z are one run of the volume's memory.
    std::memcpy(block.bytes.data(), &volume.block.bytes[std::size_t(volume.block.Offset(block.box.begin))], block.bytes.size());
    slabs.push_back(std::make_unique<SlabData>(std::move(block)));
  }

  const std::unique_ptr<Renderer> renderer = MakeRenderer(renderer_kind);
  const std::atomic<bool> cancelled{false};
  const auto render = [&](RankReport& report) {
    for (std::size_t i = 0; i < slabs.size(); ++i) {
      benchmark::DoNotOptimize(renderer->Render(*slabs[i], partition.boxes()[i], setup, cancelled, report).value());
    }
  };
  RankReport first, report;
  render(first);
  for (auto _ : state) {
    report.spans.clear();
    render(report);
  }
  const double frames = double(state.iterations()) * 1e6;
  state.counters["first_prepare"] = double(first.stage_ns[std::size_t(Stage::kPrepare)]) / 1e6;
  for (Stage stage : {Stage::kTransform, Stage::kShade, Stage::kSplat, Stage::kComposite, Stage::kZBuffer}) {
    if (const auto ns = report.stage_ns[std::size_t(stage)]; ns != 0) state.counters[std::string(ToString(stage))] = double(ns) / frames;
  }
  state.counters["voxels"] = double(first.drawn_voxels);
}
BENCHMARK(Stages)->ArgNames({"class", "p", "renderer"})->ArgsProduct({{1, 2}, {1, 2}, {1, 2}})->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
