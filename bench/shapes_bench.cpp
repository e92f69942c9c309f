// Frames of a bumpy ball of many triangles that fills most of 512 x 512 pixels, from a camera that moves each frame: all tiles, drawn by
// two threads. Beside it, where the build finds Embree 3 (Wald et al., 2014): the nearest triangles of one and of four rays a pixel,
// without shading, on the same threads.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <map>
#include <memory>
#include <random>

#include "common/parallel/parallel.h"
#include "common/parallel/task_arena.h"
#include "common/shapes/packed_shape.h"
#include "worker/shapes/frame_shapes.h"
#ifdef SLABSTREAM_EMBREE
#include <embree3/rtcore.h>
#endif

namespace slabstream {
namespace {

constexpr int kThreads = 2;
constexpr int kSide = 512;  // pixels
const VolumeGeometry kVolume = {{256, 256, 256}};

// The least time of a frame on the clock, and of all processors: what other programs of a busy machine take least of.
class Least {
 public:
  template <class Frame>
  void Time(Frame&& frame) {
    const std::clock_t cpu = std::clock();
    const auto begin = std::chrono::steady_clock::now();
    frame();
    ms_ = std::min(ms_, 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    cpu_ms_ = std::min(cpu_ms_, 1e3 * double(std::clock() - cpu) / CLOCKS_PER_SEC);
  }
  void Report(benchmark::State& state) const {
    state.counters["least_ms"] = ms_;
    state.counters["least_cpu_ms"] = cpu_ms_;
  }

 private:
  double ms_ = HUGE_VAL, cpu_ms_ = HUGE_VAL;
};

double Seconds(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// The six sides of a cube, each of squares of two triangles, blown up.
Shape Ball(std::int64_t triangles) {
  const auto n = std::uint32_t(std::lround(std::sqrt(double(triangles) / 12)));
  const double radius = 0.9 * BoundingRadius(kVolume);
  Shape shape;
  shape.origin = kVolume.centre();
  for (int face = 0; face < 6; ++face) {
    const auto first = std::uint32_t(shape.positions.size());
    for (std::uint32_t y = 0; y <= n; ++y) {
      for (std::uint32_t x = 0; x <= n; ++x) {
        Vec3 p;
        p[face % 3] = face < 3 ? 1 : -1;
        p[(face + 1) % 3] = std::tan((2.0 * x / n - 1) * 0.7853981633974483);
        p[(face + 2) % 3] = std::tan((2.0 * y / n - 1) * 0.7853981633974483);
        p = Normalized(p);
        p = radius * (1 + 0.03 * std::sin(20 * p.x) * std::sin(17 * p.y + 9 * p.z)) * p;
        shape.positions.push_back({float(p.x), float(p.y), float(p.z)});
      }
    }
    for (std::uint32_t y = 0; y < n; ++y) {
      for (std::uint32_t x = 0; x < n; ++x) {
        const std::uint32_t v = first + y * (n + 1) + x;
        shape.triangles.push_back({v, v + 1, v + n + 1});
        shape.triangles.push_back({v + 1, v + n + 2, v + n + 1});
      }
    }
  }
  return shape;
}

const Shape& BallOf(std::int64_t triangles) {
  static std::map<std::int64_t, Shape> balls;
  const auto found = balls.find(triangles);
  return found != balls.end() ? found->second : balls.emplace(triangles, Ball(triangles)).first->second;
}

FrameSetup SetupOf(int frame, Projection projection) {
  FrameSetup setup;
  setup.description.geometry = kVolume;
  setup.camera =
      MakeCamera({.projection = projection, .azimuth_degrees = 30.0 + frame, .elevation_degrees = 20.0}, {kSide, kSide}, kVolume);
  return setup;
}

template <class DrawTile>
void ForEachTile(DrawTile&& draw) {
  constexpr int kTiles = kSide / kShapeTile;
  ParallelFor(0, kTiles * kTiles, [&](int tile) { draw(tile % kTiles * kShapeTile, tile / kTiles * kShapeTile); });
}

void RunFrames(benchmark::State& state, const Shape& shape, const ShapeLook& look, Projection projection) {
  TaskArena arena(kThreads);
  const auto packed = std::make_shared<VoxelBlock>();
  const auto begin = std::chrono::steady_clock::now();
  packed->bytes = arena.Run([&] { return PackShape(shape).value(); });
  state.counters["pack_s"] = Seconds(begin);
  state.counters["bytes_per_part"] = double(packed->bytes.size()) / double(std::max(shape.triangles.size(), shape.positions.size()));
  int frame = 0;
  std::size_t bytes = 0;
  double make = 0;
  Least least;
  for (auto _ : state) {
    FrameSetup setup = SetupOf(frame++, projection);
    setup.shapes.emplace_back().look = look;
    const std::shared_ptr<const VoxelBlock> block = packed;
    least.Time([&] {
      arena.Run([&] {
        const auto start = std::chrono::steady_clock::now();
        const auto shapes = MakeFrameShapes(setup, std::span(&block, 1), nullptr).value();
        make += Seconds(start);
        ForEachTile([&](int x, int y) { benchmark::DoNotOptimize(shapes->TileAt(x, y).fragments.data()); });
        bytes = shapes->bytes();
      });
    });
  }
  least.Report(state);
  state.counters["make_ms"] = 1e3 * make / double(state.iterations());
  state.counters["frame_bytes"] = double(bytes);
}

void Frames(benchmark::State& state) {
  RunFrames(state, BallOf(state.range(0)), {.color = {0.8F, 0.6F, 0.4F}, .opacity = double(state.range(2)) / 100},
            state.range(1) == 0 ? Projection::kOrthographic : Projection::kPerspective);
}
BENCHMARK(Frames)
    ->ArgNames({"triangles", "perspective", "opacity"})
    ->Args({1'000'000, 0, 100})
    ->Args({1'000'000, 1, 100})
    ->Args({10'000'000, 1, 100})
    ->Args({1'000'000, 1, 50})
    ->Args({10'000, 1, 100})
    ->Args({12, 1, 100})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

// A random walk in the volume, as one line, or its points.
void Walk(benchmark::State& state) {
  Shape shape;
  shape.kind = state.range(1) == 0 ? ShapeKind::kLines : ShapeKind::kPoints;
  if (state.range(1) == 0) shape.line_begins = {0};
  std::mt19937 random(1);
  Vec3 at = kVolume.centre();
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    for (const Axis axis : kAxes) at[axis] = std::clamp(at[axis] + double(random() % 1000) / 200 - 2.5, 0.0, 255.0);
    shape.positions.push_back({float(at.x), float(at.y), float(at.z)});
  }
  RunFrames(state, shape, {.color = {0.8F, 0.6F, 0.4F}}, Projection::kPerspective);
}
BENCHMARK(Walk)
    ->ArgNames({"vertices", "points"})
    ->Args({100'000, 0})
    ->Args({100'000, 1})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

#ifdef SLABSTREAM_EMBREE
void Embree(benchmark::State& state) {
  TaskArena arena(kThreads);
  const Shape& shape = BallOf(state.range(0));
  const std::int64_t per_side = state.range(1) == 4 ? 2 : 1;
  RTCDevice device = rtcNewDevice("threads=2,set_affinity=0");
  std::int64_t memory = 0;
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void* sum, ssize_t bytes, bool) { return __atomic_add_fetch(static_cast<std::int64_t*>(sum), bytes, __ATOMIC_RELAXED), true; },
      &memory);
  const auto begin = std::chrono::steady_clock::now();
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  std::vector<std::array<float, 3>> positions = shape.positions;
  positions.push_back({});
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.data(), 0, 12, shape.positions.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, shape.triangles.data(), 0, 12, shape.triangles.size());
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  state.counters["build_s"] = Seconds(begin);
  state.counters["bytes_per_triangle"] = double(memory) / double(shape.triangles.size());
  int frame = 0;
  std::int64_t hits = 0;
  Least least;
  for (auto _ : state) {
    const FrameSetup setup = SetupOf(frame++, Projection::kPerspective);
    const auto& camera = setup.camera;
    least.Time([&] {
      arena.Run([&] {
        ForEachTile([&](int x0, int y0) {
          RTCIntersectContext context;
          rtcInitIntersectContext(&context);
          context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
          alignas(64) std::array<int, 16> valid;
          valid.fill(-1);
          std::int64_t found = 0;
          const Camera::Ray corner = camera.RayAt(0, 0), right = camera.RayAt(1, 0), down = camera.RayAt(0, 1);
          const Vec3 step_x = right.direction - corner.direction, step_y = down.direction - corner.direction;
          const Vec3 origin = corner.origin - shape.origin;
          const int side = int(kShapeTile * per_side);
          for (int y = 0; y < side; y += 4) {
            for (int x = 0; x < side; x += 4) {
              alignas(64) RTCRayHit16 rays;
              for (int i = 0; i < 16; ++i) {
                const Vec3 d = corner.direction + (x0 + (x + i % 4 + 0.5) / double(per_side)) * step_x +
                               (y0 + (y + i / 4 + 0.5) / double(per_side)) * step_y;
                rays.ray.org_x[i] = float(origin.x);
                rays.ray.org_y[i] = float(origin.y);
                rays.ray.org_z[i] = float(origin.z);
                rays.ray.dir_x[i] = float(d.x);
                rays.ray.dir_y[i] = float(d.y);
                rays.ray.dir_z[i] = float(d.z);
                rays.ray.tnear[i] = 0;
                rays.ray.tfar[i] = 1e9F;
                rays.ray.time[i] = 0;
                rays.ray.mask[i] = ~0U;
                rays.ray.flags[i] = 0;
                rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
                rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
              }
              rtcIntersect16(valid.data(), scene, &context, &rays);
              for (int i = 0; i < 16; ++i) found += rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
            }
          }
          __atomic_add_fetch(&hits, found, __ATOMIC_RELAXED);
        });
      });
    });
  }
  least.Report(state);
  state.counters["covered"] = double(hits) / double(state.iterations()) / double(kSide * kSide * per_side * per_side);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
BENCHMARK(Embree)
    ->ArgNames({"triangles", "rays"})
    ->Args({1'000'000, 1})
    ->Args({1'000'000, 4})
    ->Args({10'000'000, 1})
    ->Args({10'000'000, 4})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();
#endif

}  // namespace
}  // namespace slabstream
