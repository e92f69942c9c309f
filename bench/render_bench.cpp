// Renderings of the paper's spheres at 512 x 512 by every renderer, stage by stage, from the second frame on:
//
//   Boxes       both spheres, N = 200, as one box and as two boxes one after the other (p = 1, 2), on one thread
//   Turn        the hollow sphere, N = 200 and 256, in both projections from 12 azimuths one after the other, by 1 and 2 threads
//   EmptySpace  the hollow sphere of 128^3 voxels alone, and in the middle of 256^3 and 512^3 voxels, at a zoom that shows it in one size
//   Channels    of 256^3 and 512^3 voxels of 16 bits, one or several in a picture, cast on one thread
//
// Time is of a frame. Counters of stages are milliseconds a frame, summed over threads and boxes; `finish` is making the picture from the
// frame.
#include <benchmark/benchmark.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>

#include "common/decomposition/decomposition.h"
#include "common/parallel/task_arena.h"
#include "common/planning/frame_plan.h"
#include "laboratory/bench/bench_cases.h"
#include "worker/renderers/renderer.h"

namespace slabstream {
namespace {

constexpr std::int32_t kObject = 128;  // a side of the sphere in empty space
constexpr int kAzimuths = 12;

// Renders `boxes` boxes of the volume, from each view in turn.
void Render(benchmark::State& state, const Volume& volume, const RendererKind& kind, const std::vector<ViewParameters>& views, int boxes,
            int threads) {
  const BenchCase look = StandardSphere(SphereClass::kHollow, kObject, &kind);
  const auto summary = std::make_shared<const VolumeSummary>(Summarize(volume));
  std::vector<FrameSetup> setups;
  for (const ViewParameters& view : views)
    setups.push_back(MakeFrameSetup(ResolveRequest(BenchRequest(look, view, {512, 512}), 1, summary).value()).value());

  const WorkField voxels = WorkField::Uniform(volume.description.geometry.size);
  const Partition partition = MakeSlabs({.work = &voxels, .boxes = boxes});
  std::vector<std::unique_ptr<BoxData>> data;
  for (const Box& box : partition.boxes()) {
    data.push_back(std::make_unique<BoxData>(BrickedVoxels(CutBlock(volume.block, PaddedBox(box, setups[0])))));
  }

  const std::unique_ptr<Renderer> renderer = MakeRenderer(kind);
  RenderControl control;
  TaskArena arena(threads);
  std::chrono::duration<double, std::milli> finish{};
  std::size_t frame = 0;
  const auto render = [&](RankReport& report) {
    arena.Run([&] {
      const FrameSetup& setup = setups[frame++ % setups.size()];
      LocalImage image;
      for (std::size_t i = 0; i < data.size(); ++i) {
        image = renderer->Render(*data[i], partition.boxes()[i], setup, {}, control, report).value();
        benchmark::DoNotOptimize(image.rgba.data());
      }
      const auto begin = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(kind.Finish(image, setup));
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

  const auto frames = double(state.iterations());
  state.SetLabel(std::string(kind.name()));
  state.counters["first_prepare"] = double(first.stage_ns[std::size_t(Stage::kPrepare)]) / 1e6;
  for (const Stage stage : kind.stages()) {
    state.counters[std::string(ToString(stage))] = double(report.stage_ns[std::size_t(stage)]) / 1e6 / frames;
  }
  state.counters["finish"] = finish.count() / frames;
  state.counters["drawn"] = double(report.drawn_voxels) / frames;
  double derived_bytes = 0;
  for (const auto& box : data) derived_bytes += double(box->derived_bytes());
  state.counters["derived_MB"] = derived_bytes / 1e6;
}

const RendererKind& KindAt(std::int64_t index) { return *Renderers()[std::size_t(index)]; }

// That draws volumes.
std::vector<std::int64_t> EveryRenderer() {
  std::vector<std::int64_t> numbers = benchmark::CreateDenseRange(0, std::int64_t(Renderers().size()) - 1, 1);
  std::erase_if(numbers, [](std::int64_t number) { return KindAt(number).Can(Ability::kCells); });
  return numbers;
}

void Boxes(benchmark::State& state) {
  const auto sphere = SphereClass(state.range(0));
  const Volume volume = MakeSphere({sphere, 200, sphere == SphereClass::kHollow ? 0.05 : 0.40}).value();
  Render(state, volume, KindAt(state.range(2)), {{.azimuth_degrees = 30, .elevation_degrees = 20}}, int(state.range(1)), 1);
}
BENCHMARK(Boxes)->ArgNames({"class", "p", "renderer"})->ArgsProduct({{1, 2}, {1, 2}, EveryRenderer()})->Unit(benchmark::kMillisecond);

void Turn(benchmark::State& state) {
  if (Projection(state.range(1)) == Projection::kPerspective && !KindAt(state.range(3)).Can(Ability::kPerspective)) {
    state.SkipWithError("draws no perspective");
    return;
  }
  std::vector<ViewParameters> views;
  for (int i = 0; i < kAzimuths; ++i) views.push_back(BenchView(Projection(state.range(1)), i, kAzimuths));
  const Volume volume = MakeSphere({SphereClass::kHollow, int(state.range(0)), 0.05}).value();
  Render(state, volume, KindAt(state.range(3)), views, 1, int(state.range(2)));
}
BENCHMARK(Turn)
    ->ArgNames({"N", "projection", "threads", "renderer"})
    ->ArgsProduct({{200, 256}, {int(Projection::kOrthographic), int(Projection::kPerspective)}, {1, 2}, EveryRenderer()})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

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
  const Volume volume = Surround(MakeSphere({SphereClass::kHollow, kObject, 0.05}).value(), side);
  const ViewParameters view{.azimuth_degrees = 30, .elevation_degrees = 20, .zoom = double(side) / kObject};
  Render(state, volume, KindAt(state.range(1)), {view}, 1, DefaultThreads());
}
BENCHMARK(EmptySpace)
    ->ArgNames({"side", "renderer"})
    ->ArgsProduct({{128, 256, 512}, EveryRenderer()})
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

// A channel of cells: most of the volume is empty, and channels overlap here and there. 16 bits.
Volume MakeChannel(std::int32_t side, int channel) {
  Volume volume;
  volume.description = {.geometry = {.size = Uniform(side)}, .type = ScalarType::kUint16, .mapping = {}};
  volume.block = MakeVoxelBlock(volume.description.geometry.bounds(), ScalarType::kUint16);
  std::vector<float> waves[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double periods = 3 + (channel + axis) % 4;
    for (std::int32_t i = 0; i < side; ++i) waves[axis].push_back(float(std::sin(2 * 3.14159265 * (periods * i / side + 0.21 * channel))));
  }
  auto* sample = volume.block.samples<std::uint16_t>();
  for (std::int32_t z = 0; z < side; ++z) {
    for (std::int32_t y = 0; y < side; ++y) {
      for (std::int32_t x = 0; x < side; ++x) {
        const float density = waves[0][std::size_t(x)] * waves[1][std::size_t(y)] * waves[2][std::size_t(z)];
        *sample++ = density > 0 ? std::uint16_t(60000 * density) : 0;
      }
    }
  }
  return volume;
}

void Channels(benchmark::State& state) {
  const auto side = std::int32_t(state.range(0));
  constexpr Rgb kColors[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {0, 1, 1}, {1, 0, 1}};
  std::vector<std::unique_ptr<BoxData>> channels;
  FrameSetup setup;
  for (int i = 0; i < int(state.range(1)); ++i) {
    const Volume volume = MakeChannel(side, i);
    const TransferFunction transfer = {.colors = {{0, kColors[i % 6]}}, .opacities = {{20000, 0, 0.5, 0}, {60000, 0.2, 0.5, 0}}};
    if (i == 0) {
      setup.description = volume.description;
      setup.range = {0, 60000};
      SetRenderer(*FindRenderer("raycast"), setup);
      setup.camera = MakeCamera({.azimuth_degrees = 30, .elevation_degrees = 20}, {512, 512}, volume.description.geometry);
      setup.transfer = transfer;
    } else {
      setup.fields.push_back(
          {.levels = {{DatasetId(i), volume.description, {}}}, .of_volume = {0}, .look = {.transfer = transfer, .range = {0, 60000}}});
    }
    channels.push_back(std::make_unique<BoxData>(std::make_shared<BoxVoxels>(Pad(VoxelBricks(volume.block), volume.block.box), nullptr)));
  }
  std::vector<BoxData*> fields;
  for (std::size_t i = 1; i < channels.size(); ++i) fields.push_back(channels[i].get());
  channels[0]->SetFields(fields);
  const std::unique_ptr<Renderer> renderer = MakeRenderer(*setup.renderer);
  TaskArena arena(1);
  RankReport report;
  const auto render = [&] {
    arena.Run([&] {
      benchmark::DoNotOptimize(
          renderer->Render(*channels[0], setup.description.geometry.bounds(), setup, {}, RenderControl(), report).value().rgba.data());
    });
  };
  render();
  for (auto _ : state) render();
}
BENCHMARK(Channels)->ArgNames({"side", "channels"})->ArgsProduct({{256, 512}, {1, 2, 4}})->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slabstream
