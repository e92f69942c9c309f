// Which level a request draws, and that it shows the same part of the world at the same scale at every level.
#include "common/planning/levels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "common/view/world_limits.h"
#include "common/volume/indices.h"
#include "tests/common/view/random_view.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

FrameRequest SomeRequest() {
  FrameRequest request;
  request.dataset = "head";
  request.renderer = "splat";
  request.transfer.choice = TransferFunction{.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0.5}}};
  return request;
}

// Of voxels that are all visible.
VolumeSummary SummaryOf(const VolumeGeometry& geometry) {
  VolumeSummary summary{.description = {.geometry = geometry}, .range = {0, 255}};
  summary.histogram.fill(1);
  summary.brick_counts = CubesOver(geometry.size, kBrick);
  summary.bricks.assign(CountIn(summary.brick_counts), {0, 255});
  return summary;
}

// The same part of the world with `step` voxels of `finest` in one along each axis; the last ones may reach beyond its border.
VolumeGeometry Coarser(const VolumeGeometry& finest, const Index3& step) {
  VolumeGeometry level = finest;
  Vec3 first;
  for (const Axis axis : kAxes) {
    level.size[axis] = (finest.size[axis] + step[axis] - 1) / step[axis];
    level.spacing[axis] = finest.spacing[axis] * step[axis];
    first[axis] = 0.5 * (step[axis] - 1) * finest.spacing[axis];
  }
  level.orientation.origin = finest.orientation.origin + finest.orientation.ToWorld(first);
  return level;
}

VolumeGeometry RandomCoarser(Random& random, const VolumeGeometry& finest) {
  const auto step = [&] { return 1 << random.Integer(0, 3); };
  return Coarser(finest, {step(), step(), step()});
}

Vec3 ToVoxels(const Vec3& world, const VolumeGeometry& geometry) {
  return geometry.orientation.FromWorld(world - geometry.orientation.origin) / geometry.spacing;
}

Vec3 RandomPointIn(Random& random, const VolumeGeometry& geometry) {
  Vec3 p;
  for (const Axis axis : kAxes) p[axis] = random.Real(-0.5, geometry.size[axis] - 0.5);
  return geometry.ToWorld(p);
}

// A view of `finest` that `level` can be shown in, too, in every way in which one can say it.
FrameRequest RandomRequestOf(Random& random, const VolumeGeometry& finest, const VolumeGeometry& level) {
  for (;;) {
    FrameRequest request = SomeRequest();
    request.size = {random.Integer(1, 400), random.Integer(1, 400)};
    request.view = RandomViewOf(finest, random);
    const Vec3 direction = RandomAxes(random)[0];
    const double distance = random.Real(3, 9) * BoundingRadius(finest);
    if (random.Chance(0.2)) request.view.eye = finest.ToWorld(finest.centre()) + distance * direction;
    if (!request.view.eye && random.Chance(0.2)) request.view.distance = distance;
    if (!CheckView(request.view, finest).ok()) continue;
    if (CheckView(AtLevel(request, finest, level).view, level).ok()) return request;
  }
}

TEST(AtLevelTest, PointsOfTheWorldFallOnTheSamePixels) {
  Random random(321);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 500; ++round) {
    const VolumeGeometry finest = RandomGeometry(random, random.Chance(0.5) ? World::kPatient : World::kScene);
    const VolumeGeometry level = RandomCoarser(random, finest);
    const FrameRequest request = RandomRequestOf(random, finest, level);
    const Camera camera = MakeCamera(request.view, request.size, finest);
    const Camera coarse = MakeCamera(AtLevel(request, finest, level).view, request.size, level);
    for (int i = 0; i < 10; ++i) {
      const Vec3 world = RandomPointIn(random, finest);
      const Camera::ImagePoint at = camera.Project(ToVoxels(world, finest)), same = coarse.Project(ToVoxels(world, level));
      const double near = 1e-7 * (1 + std::abs(at.x) + std::abs(at.y));
      ASSERT_NEAR(at.x, same.x, near) << "round " << round << ", " << NameOf(request.view.projection);
      ASSERT_NEAR(at.y, same.y, near) << "round " << round << ", " << NameOf(request.view.projection);
      ASSERT_NEAR(at.depth, same.depth, 1e-7 * (1 + std::abs(at.depth))) << "round " << round << ", " << NameOf(request.view.projection);
    }
  }
}

Clipping RandomClipping(Random& random, const VolumeGeometry& finest) {
  Clipping clipping;
  if (random.Chance(0.7)) {
    constexpr std::array<ClipUnit, 3> kUnits = {ClipUnit::kWorld, ClipUnit::kVoxels, ClipUnit::kPercent};
    ClipBox box{.unit = kUnits.at(random.Integer<std::size_t>(0, 2))};
    const Vec3 a = RandomPointIn(random, finest), b = RandomPointIn(random, finest);
    for (const Axis axis : kAxes) {
      const double side = box.unit == ClipUnit::kVoxels ? finest.size[axis] : 100;
      const double one = box.unit == ClipUnit::kWorld ? a[axis] : random.Real(0, side);
      const double other = box.unit == ClipUnit::kWorld ? b[axis] : random.Real(0, side);
      box.low[axis] = random.Chance(0.2) ? -kMaxCoordinate : std::min(one, other);
      box.high[axis] = random.Chance(0.2) ? kMaxCoordinate : std::max(one, other);
    }
    clipping.box = box;
  }
  if (random.Chance(0.5)) {
    ClipSlab slab{.normal = RandomAxes(random)[0], .thickness = random.Real(0.2, 1) * BoundingRadius(finest)};
    if (random.Chance(0.4)) slab.through = RandomPointIn(random, finest);
    if (!slab.through && random.Chance(0.6)) slab.index = random.Integer(0, finest.size[AxisAcross(slab, finest)] - 1);
    clipping.slab = slab;
  }
  if (random.Chance(0.3)) {
    const Vec3 normal = RandomAxes(random)[0];
    clipping.planes.push_back({normal, -Dot(normal, RandomPointIn(random, finest))});
  }
  if (random.Chance(0.3)) clipping.mode = ClipMode::kCutAway;
  return clipping;
}

// The least distance of a side; the point is in the region if it is not negative.
double DistanceIn(const ClipRegion& region, const Vec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const HalfSpace& side : region.sides) least = std::min(least, side.Distance(p));
  return least;
}

TEST(AtLevelTest, AClipRegionKeepsTheSamePointsOfTheWorld) {
  Random random(322);
  SCOPED_TRACE(random.trace());
  int inside = 0, outside = 0;
  for (int round = 0; round < 1000; ++round) {
    const VolumeGeometry finest = RandomGeometry(random, random.Chance(0.5) ? World::kPatient : World::kScene);
    const VolumeGeometry level = RandomCoarser(random, finest);
    FrameRequest request = SomeRequest();
    request.clipping = RandomClipping(random, finest);
    const Result<ClipRegion> region = MakeClipRegion(request.clipping, finest);
    const Result<ClipRegion> coarse = MakeClipRegion(AtLevel(request, finest, level).clipping, level);
    ASSERT_TRUE(region.ok()) << region.status().message();
    ASSERT_TRUE(coarse.ok()) << coarse.status().message();
    EXPECT_EQ(region->mode, coarse->mode);
    for (int i = 0; i < 20; ++i) {
      const Vec3 world = RandomPointIn(random, finest);
      const double distance = DistanceIn(*region, ToVoxels(world, finest));
      if (std::abs(distance) < 1e-6) continue;
      ASSERT_EQ(distance >= 0, DistanceIn(*coarse, ToVoxels(world, level)) >= 0) << "round " << round << ", distance " << distance;
      ++(distance >= 0 ? inside : outside);
    }
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(AtLevelTest, MaterialOfALengthKeepsItsOpacity) {
  Random random(323);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 100; ++round) {
    const VolumeGeometry finest = RandomGeometry(random), level = RandomCoarser(random, finest);
    FrameRequest request = SomeRequest();
    request.transfer.opacity_distance = random.Real(0.1, 10);
    const double length = request.transfer.opacity_distance * Least(finest.spacing);
    EXPECT_NEAR(AtLevel(request, finest, level).transfer.opacity_distance * Least(level.spacing), length, 1e-9 * length);
  }
}

TEST(AtLevelTest, TheFinestLevelChangesNothing) {
  Random random(324);
  SCOPED_TRACE(random.trace());
  const VolumeGeometry finest = RandomGeometry(random);
  FrameRequest request = SomeRequest();
  request.clipping = RandomClipping(random, finest);
  EXPECT_EQ(AtLevel(request, finest, finest), request);
}

// Each level has half as many voxels along each axis as the one before. The overview is the coarsest one.
VolumeLevels HalvedLevels(const VolumeGeometry& finest, int count) {
  VolumeLevels levels;
  for (int level = 0; level < count; ++level) {
    const std::int32_t step = 1 << level;
    levels.levels.push_back({.geometry = Coarser(finest, {step, step, step})});
  }
  levels.overview = std::make_shared<const VolumeSummary>(SummaryOf(levels.levels.back().geometry));
  return levels;
}

VolumeGeometry RandomDivisible(Random& random, std::int32_t by) {
  VolumeGeometry finest = RandomGeometry(random);
  for (const Axis axis : kAxes) finest.size[axis] = by * random.Integer(1, 8);
  finest.spacing = random.Real(0.1, 4) * Vec3{1, 1, 1};
  return finest;
}

// Width of a pixel where the picture shows the nearest corner of the volume, from the picture's scale alone.
double NearestPixel(const FrameRequest& request, const VolumeGeometry& geometry) {
  const ViewParameters& view = request.view;
  const double half_side = 0.5 * std::min(request.size.width, request.size.height), radius = BoundingRadius(geometry);
  if (view.projection == Projection::kOrthographic) return radius / (view.zoom * half_side);
  const Camera camera = MakeCamera(view, request.size, geometry);
  double nearest = std::numeric_limits<double>::infinity();
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (const Axis axis : kAxes) p[axis] = (corner >> int(axis) & 1) != 0 ? geometry.size[axis] - 0.5 : -0.5;
    nearest = std::min(nearest, camera.Project(p).depth);
  }
  return nearest * std::tan(view.fov_degrees * std::numbers::pi / 360) / (view.zoom * half_side);
}

// Of a picture of one level.
int LevelOf(const FrameRequest& request, const VolumeLevels& levels) {
  const Result<LevelMap> map = LevelsOf(request, levels);
  EXPECT_TRUE(map.ok()) << map.status().message();
  if (!map.ok()) return -1;
  EXPECT_TRUE(map->one_level());
  EXPECT_THAT(map->levels, testing::SizeIs(1));
  return map->levels.front();
}

TEST(LevelOfTest, IsTheCoarsestWhoseVoxelsAreNotWiderThanDetail) {
  Random random(325);
  SCOPED_TRACE(random.trace());
  constexpr int kLevels = 4;
  std::array<int, kLevels> seen{};
  for (int round = 0; round < 500; ++round) {
    const VolumeGeometry finest = RandomDivisible(random, 8);
    const VolumeLevels levels = HalvedLevels(finest, kLevels);
    FrameRequest request = RandomRequestOf(random, finest, levels.levels.back().geometry);
    request.detail = std::exp(random.Real(-3, 3));
    const double most = request.detail * NearestPixel(request, finest);
    int expected = 0;
    bool on_the_border = false;
    for (int level = 1; level < kLevels; ++level) {
      const double width = finest.spacing.x * (1 << level);
      on_the_border |= std::abs(width / most - 1) < 1e-6;
      if (width <= most) expected = level;
    }
    if (on_the_border) continue;
    const int level = LevelOf(request, levels);
    ASSERT_EQ(level, expected) << "round " << round << ", " << NameOf(request.view.projection);
    ++seen.at(std::size_t(level));
  }
  for (const int count : seen) EXPECT_GT(count, 0);
}

TEST(LevelOfTest, IsNeverFinerWithMoreDetailPixelsNorCoarserWithMoreZoom) {
  Random random(326);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 100; ++round) {
    const VolumeGeometry finest = RandomDivisible(random, 8);
    const VolumeLevels levels = HalvedLevels(finest, 4);
    FrameRequest request = RandomRequestOf(random, finest, levels.levels.back().geometry);
    const FrameRequest asked = request;
    int before = 0;
    for (request.detail = 0.01; request.detail <= 1000; request.detail *= 1.7) {
      const int level = LevelOf(request, levels);
      ASSERT_GE(level, before);
      before = level;
    }
    request = asked;
    before = 3;
    for (request.view.zoom = 1e-2; request.view.zoom <= 100; request.view.zoom *= 1.7) {
      const int level = LevelOf(request, levels);
      ASSERT_LE(level, before);
      before = level;
    }
  }
}

TEST(LevelOfTest, AxesThatKeepTheirSpacingDoNotCount) {
  VolumeLevels levels = HalvedLevels({{64, 64, 8}, {1, 1, 20}}, 1);
  levels.levels.push_back(levels.levels[0]);
  levels.levels[1].geometry = Coarser(levels.levels[0].geometry, {2, 2, 1});
  FrameRequest request = SomeRequest();
  const double pixel = NearestPixel(request, levels.levels[0].geometry);
  request.detail = 2.1 / pixel;
  EXPECT_EQ(LevelOf(request, levels), 1) << "slices are 20 apart in the finest level, too";
  request.detail = 1.9 / pixel;
  EXPECT_EQ(LevelOf(request, levels), 0);
}

// An adaptive mesh: whatever the view, the zones of a box that is refined are drawn from its level, unless a pixel shows no more than the
// coarser one, and the others from coarser levels, next to each other.
TEST(LevelOfTest, AnAdaptiveMeshIsDrawnFromLevelsThatHaveVoxelsThere) {
  Random random(327);
  SCOPED_TRACE(random.trace());
  const VolumeGeometry finest{{512, 512, 512}};
  VolumeLevels levels = HalvedLevels(finest, 3);
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    for (int round = 0; round < 20; ++round) {
      levels.refined = {nullptr, nullptr, nullptr};
      for (const std::size_t level : {0U, 1U}) {
        auto boxes = std::make_shared<std::vector<Box>>();
        const std::int32_t side = levels.levels[level].geometry.size.x;
        for (int i = 0; i < 2; ++i) {
          const Index3 begin = {random.Integer(0, side - 32), random.Integer(0, side - 32), random.Integer(0, side - 32)};
          boxes->push_back({begin, begin + Uniform(random.Integer(1, 32))});
        }
        levels.refined[level] = std::move(boxes);
      }
      FrameRequest request = SomeRequest();
      request.renderer = "raycast";
      request.view.projection = projection;
      request.detail = 0.01;
      const Result<LevelMap> map = LevelsOf(request, levels);
      ASSERT_TRUE(map.ok()) << map.status().message();
      ASSERT_THAT(map->levels, testing::ElementsAre(0, 1, 2));
      int at_finest = 0;
      for (const Index3& zone : IndicesIn(map->counts)) {
        const Box box = map->BoxOf(zone, finest.size);
        std::uint8_t needed = 2, beside = 2;  // by what lies in the zone, or in one beside it
        for (const std::size_t level : {1U, 0U}) {
          for (const Box& refined : *levels.refined[level]) {
            const std::int32_t step = 1 << level;
            const Box there = {refined.begin * Uniform(step), refined.end * Uniform(step)};
            if (!Intersection(box, there).empty()) needed = std::uint8_t(level);
            if (!Intersection(Grown(box, 2 * map->side.x, finest.bounds()), there).empty()) beside = std::uint8_t(level);
          }
        }
        ASSERT_LE(map->Of(zone), needed);
        if (beside == 2) {
          ASSERT_EQ(map->Of(zone), 2);
        }
        at_finest += map->Of(zone) == 0 ? 1 : 0;
      }
      EXPECT_LE(at_finest, 2 * 8 * 8) << "two boxes of 32 voxels, and their neighbours";
      if (projection == Projection::kOrthographic) {
        request.view.azimuth_degrees = random.Integer(0, 359);
        request.view.zoom = 2;
        const LevelMap turned = LevelsOf(request, levels).value();
        if (turned.levels == map->levels) {  // else the picture shows nothing of the finest one
          EXPECT_EQ(turned, *map) << "voxels stay where they are";
        }
      }
      request.detail = 1000;
      EXPECT_EQ(LevelOf(request, levels), 2);
    }
  }
}

TEST(LevelOfTest, ANamedLevelIsTakenOrRefused) {
  const VolumeLevels levels = HalvedLevels({{64, 64, 64}}, 3);
  FrameRequest request = SomeRequest();
  for (int level = 0; level < 3; ++level) {
    request.level = std::to_string(level);
    EXPECT_EQ(LevelOf(request, levels), level);
  }
  request.level = "3";
  const Status refused = LevelsOf(request, levels).status();
  EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.message(), "level is 3, but dataset \"head\" has levels 0 to 2");
}

TEST(LevelOfTest, LargerLevelsGiveWayToSmallerOnes) {
  const VolumeLevels levels = HalvedLevels({{64, 64, 64}}, 3);  // of 262144, 32768 and 4096 bytes
  const LevelMap several = {.levels = {0, 1}, .side = {32, 32, 32}, .counts = {2, 2, 2}, .of_zone = {0, 0, 0, 0, 1, 1, 1, 1}};
  EXPECT_EQ(NoneLarger(several, 262144, levels), several);
  EXPECT_EQ(NoneLarger(several, 262143, levels), LevelMap{.levels = {1}});
  EXPECT_EQ(NoneLarger({.levels = {1}}, 5000, levels), LevelMap{.levels = {2}});
  EXPECT_EQ(NoneLarger({.levels = {2}}, 100, levels), LevelMap{.levels = {2}});
}

TEST(LevelOfTest, ASliceThatTheFinestLevelDoesNotHaveIsRefusedAtEveryLevel) {
  const VolumeLevels levels = HalvedLevels({{64, 64, 64}}, 3);
  FrameRequest request = SomeRequest();
  for (const char* const level : {"auto", "0", "2"}) {
    request.level = level;
    request.clipping.slab = ClipSlab{.index = 63, .thickness = 4};
    EXPECT_TRUE(LevelsOf(request, levels).ok()) << level;
    request.clipping.slab->index = 64;
    const Status refused = LevelsOf(request, levels).status();
    EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument) << level;
    EXPECT_THAT(refused.message(), HasSubstr("clip.slab.index is 64, but the volume has slices 0 to 63 along z")) << level;
  }
}

// A picture of several levels, in perspective, of a volume with cubic voxels.
struct MixedCase {
  VolumeLevels levels;
  FrameRequest request;
  LevelMap map;
};
MixedCase RandomMixed(Random& random) {
  for (;;) {
    MixedCase mixed;
    VolumeGeometry finest = RandomGeometry(random);
    for (const Axis axis : kAxes) finest.size[axis] = 16 * random.Integer(8, 80) + random.Integer(0, 7);
    finest.spacing = random.Real(0.1, 4) * Vec3{1, 1, 1};
    mixed.levels = HalvedLevels(finest, 4);
    FrameRequest& request = mixed.request = RandomRequestOf(random, finest, mixed.levels.levels.back().geometry);
    request.renderer = std::array{"raycast", "mip", "xray"}.at(random.Integer<std::size_t>(0, 2));
    request.size = {random.Integer(16, 400), random.Integer(16, 400)};
    request.view.projection = Projection::kPerspective;
    request.view.fov_degrees = random.Real(20, 100);
    request.view.eye.reset();
    request.view.distance = random.Real(0.8, 1.6) * BoundingRadius(finest);
    if (!CheckView(AtLevel(request, finest, mixed.levels.levels.back().geometry).view, mixed.levels.levels.back().geometry).ok()) continue;
    if (!CheckView(request.view, finest).ok()) continue;
    request.detail = std::exp(random.Real(-1, 3));
    Result<LevelMap> map = LevelsOf(request, mixed.levels);
    if (!map.ok() || map->one_level()) continue;
    mixed.map = *std::move(map);
    return mixed;
  }
}

// The finest level of the zones that touch a zone at a side.
int LeastBeside(const LevelMap& map, const Index3& zone) {
  int least = std::numeric_limits<int>::max();
  for (const Axis axis : kAxes) {
    for (const int step : {-1, 1}) {
      Index3 beside = zone;
      beside[axis] += step;
      if (beside[axis] < 0 || beside[axis] == map.counts[axis] || map.Of(beside) == LevelMap::kOutside) continue;
      least = std::min(least, map.levels.at(map.Of(beside)));
    }
  }
  return least;
}

TEST(LevelsOfTest, EachPartIsDrawnFromTheCoarsestLevelThatIsFineEnough) {
  Random random(327);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const auto [levels, request, map] = RandomMixed(random);
    const VolumeGeometry& grid = levels.levels[std::size_t(map.levels.front())].geometry;
    const Camera camera = MakeCamera(AtLevel(request, levels.levels.front().geometry, grid).view, request.size, grid);
    const auto width_of = [&](int level) { return levels.levels[std::size_t(level)].geometry.spacing.x; };
    const auto too_wide = [&](int level, double depth) {
      return width_of(level) > (1 + 1e-6) * request.detail * camera.PixelSizeAt(depth);
    };
    ASSERT_TRUE(std::ranges::is_sorted(map.levels));
    ASSERT_EQ(map.of_zone.size(), CountIn(map.counts));
    for (const Index3& zone : IndicesIn(map.counts)) {
      const Box box = map.BoxOf(zone, grid.size);
      double nearest = std::numeric_limits<double>::infinity();
      for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (const Axis axis : kAxes) p[axis] = ((corner >> int(axis) & 1) != 0 ? box.end[axis] : box.begin[axis]) - 0.5;
        nearest = std::min(nearest, camera.Project(p).depth);
      }
      Vec3 inside;
      for (const Axis axis : kAxes) inside[axis] = random.Real(box.begin[axis] - 0.5, box.end[axis] - 0.5);
      const Camera::ImagePoint seen = camera.Project(inside);
      if (map.Of(zone) == LevelMap::kOutside) {
        ASSERT_FALSE(seen.x > 0 && seen.y > 0 && seen.x < camera.width && seen.y < camera.height) << "what the picture shows is drawn";
        continue;
      }
      const int level = map.levels.at(map.Of(zone));
      ASSERT_FALSE(level != map.levels.front() && too_wide(level, nearest));
      const bool coarsest = level == 3 || width_of(level + 1) > (1 - 1e-6) * request.detail * camera.PixelSizeAt(nearest);
      ASSERT_TRUE(coarsest || LeastBeside(map, zone) < level) << "only beside a finer zone";
    }
  }
}

TEST(LevelsOfTest, NeighbouringZonesDifferByALevelAtMost) {
  Random random(328);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 60; ++round) {
    const auto [levels, request, map] = RandomMixed(random);
    for (const Index3& zone : IndicesIn(map.counts)) {
      if (map.Of(zone) == LevelMap::kOutside) continue;
      ASSERT_GE(LeastBeside(map, zone), map.levels.at(map.Of(zone)) - 1) << "round " << round;
    }
  }
}

// Views that show a corner of the volume, or nothing of it: the bounds of large zones may lie in the picture where those of smaller ones
// do not.
TEST(LevelsOfTest, APictureBesideTheVolumeHasALevel) {
  Random random(330);
  SCOPED_TRACE(random.trace());
  int nothing = 0;
  for (int round = 0; round < 3000; ++round) {
    VolumeGeometry finest = RandomGeometry(random);
    for (const Axis axis : kAxes) finest.size[axis] = 16 * random.Integer(1, 40) + random.Integer(0, 7);
    finest.spacing = random.Real(0.1, 4) * Vec3{1, 1, 1};
    VolumeLevels levels = HalvedLevels(finest, 3);
    if (random.Chance(0.5)) levels.refined.assign(3, std::make_shared<const std::vector<Box>>());
    FrameRequest request = RandomRequestOf(random, finest, levels.levels.back().geometry);
    request.renderer = "raycast";
    request.view.projection = random.Chance(0.8) ? Projection::kPerspective : Projection::kOrthographic;
    request.view.eye.reset();
    request.view.look_at = finest.ToWorld(finest.centre()) + random.Real(0.5, 4) * BoundingRadius(finest) * RandomAxes(random)[0];
    request.view.distance = random.Real(0.3, 5) * BoundingRadius(finest);
    if (random.Chance(0.3)) request.clipping = RandomClipping(random, finest);
    const Result<LevelMap> map = LevelsOf(request, levels);
    if (!map.ok()) continue;
    ASSERT_FALSE(map->levels.empty()) << "round " << round;
    if (!map->one_level()) {
      ASSERT_TRUE(std::ranges::any_of(map->of_zone, [](std::uint8_t level) { return level != LevelMap::kOutside; })) << "round " << round;
    } else {
      ++nothing;
    }
  }
  EXPECT_GT(nothing, 100);
  EXPECT_LT(nothing, 3000);
}

TEST(LevelsOfTest, WhatCannotBeMixedIsDrawnFromOneLevel) {
  Random random(329);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 20; ++round) {
    const MixedCase mixed = RandomMixed(random);
    const auto drawn = [&](const FrameRequest& request, const VolumeLevels& levels) { return LevelsOf(request, levels).value(); };
    FrameRequest request = mixed.request;
    request.renderer = "splat";
    EXPECT_TRUE(drawn(request, mixed.levels).one_level());
    request = mixed.request;
    request.renderer = "raycast";
    request.transfer.isosurfaces = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
    EXPECT_TRUE(drawn(request, mixed.levels).one_level());
    VolumeLevels shifted = mixed.levels;
    for (std::size_t level = 1; level < shifted.levels.size(); ++level)
      shifted.levels[level].geometry.size.x = std::max(shifted.levels[level].geometry.size.x >> level, 1);
    EXPECT_TRUE(drawn(mixed.request, shifted).one_level());
    VolumeLevels others = mixed.levels;
    for (std::size_t level = 1; level < others.levels.size(); ++level) others.levels[level].mapping.scale = 2 + double(level);
    EXPECT_TRUE(drawn(mixed.request, others).one_level());
  }
}

TEST(StatisticsOfTest, AreThoseOfTheOverviewWithTheFinestGeometry) {
  const VolumeLevels levels = HalvedLevels({{64, 64, 64}}, 3);
  const VolumeSummary statistics = StatisticsOf(levels);
  EXPECT_EQ(statistics.description, levels.levels[0]);
  EXPECT_EQ(statistics.range, levels.overview->range);
  EXPECT_EQ(statistics.histogram, levels.overview->histogram);
  EXPECT_TRUE(statistics.bricks.empty());
}

}  // namespace
}  // namespace slabstream
