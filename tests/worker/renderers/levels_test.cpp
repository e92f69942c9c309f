// Pictures that are drawn from several levels: they show no seam where levels meet, and do not depend on the boxes.
#include "common/planning/levels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "common/kernels/combine.h"
#include "common/planning/frame_plan.h"
#include "common/planning/level_partition.h"
#include "common/renderers/registry.h"
#include "tests/support/random.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream::testing {
namespace {

double SampleAt(const VoxelBlock& block, const Index3& v) {
  const auto at = std::size_t(block.Offset(v));
  return block.type == ScalarType::kFloat32 ? double(block.samples<float>()[at]) : double(block.samples<std::uint16_t>()[at]);
}

// Each voxel is the mean of those of the finer level that it covers.
Volume Halved(const Volume& finer) {
  VolumeGeometry geometry = finer.description.geometry;
  Vec3 first;
  for (const Axis axis : kAxes) {
    geometry.size[axis] = (geometry.size[axis] + 1) / 2;
    first[axis] = 0.5 * geometry.spacing[axis];
    geometry.spacing[axis] *= 2;
  }
  geometry.orientation.origin = geometry.orientation.origin + geometry.orientation.ToWorld(first);
  const Index3& size = finer.description.geometry.size;
  return MakeVolume(geometry, finer.description.type, [&](const Index3& v) {
    double sum = 0, count = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Index3 at = {2 * v.x + (corner & 1), 2 * v.y + (corner >> 1 & 1), 2 * v.z + (corner >> 2)};
      if (at.x >= size.x || at.y >= size.y || at.z >= size.z) continue;
      sum += SampleAt(finer.block, at);
      ++count;
    }
    return sum / count;
  });
}

std::vector<Volume> LevelsOfVolume(Volume finest, int count) {
  std::vector<Volume> levels = {std::move(finest)};
  while (int(levels.size()) < count) levels.push_back(Halved(levels.back()));
  return levels;
}

VolumeLevels Described(const std::vector<Volume>& volumes) {
  VolumeLevels levels;
  for (const Volume& volume : volumes) levels.levels.push_back(volume.description);
  levels.overview = std::make_shared<const VolumeSummary>(Summarize(volumes.back()));
  return levels;
}

// Draws `request` from the levels that `map` says, or from the finest of them alone.
struct Drawing {
  const std::vector<Volume>& volumes;
  FrameRequest request;
  LevelMap map;

  FrameSetup Setup() const {
    const VolumeGeometry& finest = volumes.front().description.geometry;
    const Volume& volume = Of(0);
    auto summary = std::make_shared<VolumeSummary>(Summarize(volume));
    summary->range = Summarize(volumes.front()).range;
    ResolvedRequest resolved = ResolveRequest(AtLevel(request, finest, volume.description.geometry), 1, summary).value();
    for (std::size_t level = 1; level < map.levels.size(); ++level) {
      resolved.coarser.push_back({level + 1, std::make_shared<const VolumeSummary>(Summarize(Of(level)))});
    }
    return MakeFrameSetup(resolved).value();
  }
  const Volume& Of(std::size_t level) const { return volumes[std::size_t(map.levels[level])]; }

  LocalImage Render(const FrameSetup& setup, const LevelPartition& boxes) const {
    LocalImage image = MakeLocalImage(setup.format, {});
    for (const BoxId id : VisibilityOrder(boxes.partition, setup.camera)) {
      if (boxes.levels[id] == LevelMap::kOutside) continue;
      const LevelBox at(boxes.partition.boxes()[id], boxes.levels[id]);
      const auto data = CutBox(Of(at.level), PaddedBox(at, setup));
      RankReport report;
      Combine(image, MakeRenderer(*setup.renderer)->Render(*data, at, setup, {}, RenderControl(), report).value(), Side::kBack);
    }
    return image;
  }

  LocalImage Mixed(int boxes = 1, std::int64_t most_voxels = 1 << 20) const {
    const FrameSetup setup = Setup();
    return Render(setup, DivideByLevels({.map = &map,
                                         .size = setup.description.geometry.size,
                                         .least_boxes = boxes,
                                         .most_bytes = most_voxels,
                                         .bytes_of = [&](const LevelBox& at) { return PaddedBox(at, setup).voxel_count(); },
                                         .blocks_of = [](std::uint8_t) { return Index3{}; }}));
  }
  LocalImage OfFinest() const {
    const FrameSetup setup = Setup();
    return Render(setup, {Partition(setup.description.geometry.bounds(), {{}}), {0}});
  }
};

// A corridor of 96 x 384 x 96 voxels that one looks along from right before it: near parts are of level 0, far ones of level 3.
Drawing DownTheCorridor(const std::vector<Volume>& volumes, std::string_view renderer) {
  FrameRequest request;
  request.renderer = renderer;
  request.size = {128, 128};
  request.view = {.projection = Projection::kPerspective, .fov_degrees = 40, .distance = 1.01 * 192 + 8};
  request.detail = 4;
  request.shading.model = ShadingModel::kNone;
  request.transfer.choice = Ramp(renderer == "raycast" ? 0.004 : 0.5);
  const LevelMap map = LevelsOf(request, Described(volumes)).value();
  return {volumes, request, map};
}

// Means of a linear field lie on it, and so does what is interpolated between them, but within half a coarse voxel of the volume's border.
TEST(Levels, ALinearFieldShowsNoSeam) {
  const auto field = [](const Index3& v) { return 20 + 0.8 * v.x + 0.25 * v.y + 0.4 * v.z; };
  const std::vector<Volume> volumes = LevelsOfVolume(MakeVolume({{96, 384, 96}}, ScalarType::kFloat32, field), 4);
  for (const char* const renderer : {"raycast", "mip", "xray"}) {
    Drawing drawing = DownTheCorridor(volumes, renderer);
    ASSERT_EQ(drawing.map.levels, (std::vector<int>{0, 1, 2, 3})) << renderer;
    drawing.request.clipping.box = ClipBox{{8, 8, 8}, {88, 376, 88}, ClipUnit::kVoxels};
    const FrameSetup setup = drawing.Setup();
    const LocalImage mixed = setup.renderer->Finish(drawing.Mixed(), setup), finest = setup.renderer->Finish(drawing.OfFinest(), setup);
    EXPECT_LE(LargestDifference(mixed, finest), 0.01F / 255) << renderer;
  }
  const Drawing with_rim = DownTheCorridor(volumes, "raycast");
  const LocalImage finest = with_rim.OfFinest();
  EXPECT_GT(PixelOf(finest, 64, 64)[3], 0.2F);
  EXPECT_LT(PixelOf(finest, 64, 64)[3], 0.9F) << "what is far shows, too";
  EXPECT_LE(LargestDifference(with_rim.Mixed(), finest), 1.0F / 255);
}

TEST(Levels, BoxesDoNotChangeThePicture) {
  const std::vector<Volume> volumes = LevelsOfVolume(MakeBlobs({{96, 384, 96}}, ScalarType::kUint16, 7), 4);
  Random random(91);
  SCOPED_TRACE(random.trace());
  for (const char* const renderer : {"raycast", "mip", "xray"}) {
    Drawing drawing = DownTheCorridor(volumes, renderer);
    drawing.request.view.azimuth_degrees = 5;
    drawing.request.view.elevation_degrees = -3;
    const LocalImage one = drawing.Mixed();
    for (int round = 0; round < 3; ++round) {
      const LocalImage other = drawing.Mixed(random.Integer(10, 60), random.Integer(20'000, 200'000));
      const float most = drawing.Setup().renderer->name() == "raycast" ? 2e-5F : 0;
      EXPECT_LE(LargestDifference(one, other), most) << renderer;
    }
  }
}

// Root mean square of the difference of columns [begin, end).
double ErrorOf(const LocalImage& a, const LocalImage& b, int begin, int end, int height) {
  double sum = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = begin; x < end; ++x) {
      const std::array<float, 4> p = PixelOf(a, x, y), q = PixelOf(b, x, y);
      for (std::size_t i = 0; i < 4; ++i) sum += (p[i] - q[i]) * (p[i] - q[i]);
    }
  }
  return std::sqrt(sum / (4.0 * height * (end - begin)));
}

// A wood of thin rods. The left half is drawn from a level, the right half from the next one.
TEST(Levels, RodsAreNoWorseBesideABorderThanWithinTheCoarserLevel) {
  std::mt19937 random(5);
  constexpr int kSide = 128;
  std::vector<std::uint8_t> rod(kSide * kSide);
  for (int i = 0; i < 500; ++i) rod[random() % rod.size()] = 1;
  const auto wood = [&](const Index3& v) {
    return rod[std::size_t(v.x) * kSide + std::size_t(v.z)] != 0 || rod[std::size_t(v.x) * kSide + std::size_t(v.y)] != 0 ? 200.0 : 0.0;
  };
  const std::vector<Volume> volumes = LevelsOfVolume(MakeVolume({{kSide, kSide, kSide}}, ScalarType::kUint16, wood), 4);
  for (int level = 0; level < 3; ++level) {
    FrameRequest request;
    request.renderer = "raycast";
    request.size = {256, 256};
    request.view = {.projection = Projection::kPerspective, .fov_degrees = 30, .distance = 600};
    request.shading.model = ShadingModel::kNone;
    request.transfer.choice = Ramp(0.5);
    const std::int32_t side = kSide >> level;
    Drawing drawing = {volumes, request, {.levels = {level, level + 1}, .side = slabstream::Uniform(side / 2), .counts = {2, 2, 2}}};
    for (int zone = 0; zone < 8; ++zone) drawing.map.of_zone.push_back(std::uint8_t(zone & 1));
    const LocalImage mixed = drawing.Mixed(), finest = drawing.OfFinest();
    const Camera camera = drawing.Setup().camera;
    const auto pixel = [&](double x) { return int(std::lround(camera.Project({x, side / 2.0, side / 2.0}).x)); };
    const double border = side / 2.0 - 0.5, reach = 2;  // one voxel of the coarser level
    const double beside = ErrorOf(mixed, finest, pixel(border - reach), pixel(border + reach), request.size.height);
    const double within = ErrorOf(mixed, finest, pixel(border + 4), pixel(side - 4), request.size.height);
    EXPECT_GT(within, 0);
    EXPECT_LE(beside, 2 * within) << "levels " << level << " and " << level + 1;
    EXPECT_LE(ErrorOf(mixed, finest, pixel(4), pixel(border - 4), request.size.height), 0.5 * within)
        << "what is drawn from the finer level";
  }
}

}  // namespace
}  // namespace slabstream::testing
