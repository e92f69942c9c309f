// The light that shapes take, against closed forms; and that a surface does not lie in its own shadow.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "common/frame/frame_map.h"
#include "common/parallel/task_arena.h"
#include "common/renderers/registry.h"
#include "common/volume/light_volume.h"
#include "tests/worker/shapes/shape_pictures.h"
#include "worker/light/shape_extinction.h"

namespace slabstream {
namespace {

using testing::EmptyFrame;
using testing::ForEachPixel;
using testing::Plane;
using testing::Point;
using testing::Scene;
using testing::SphereMesh;
using testing::ToFloats;

constexpr double kInf = std::numeric_limits<double>::infinity();
const VolumeGeometry kGrid = {{60, 60, 60}};

// Air in a frame whose lights cast shadows.
Scene Air(const VolumeGeometry& geometry, const Vec3& to_light = {0, 0, 1}) {
  static DatasetId last = 0;  // what is kept between frames is kept by these numbers
  Scene scene = {EmptyFrame(geometry, {}, {200, 200})};
  FrameSetup& setup = scene.setup;
  setup.dataset = ++last;
  setup.description.type = ScalarType::kUint8;
  setup.renderer = FindRenderer("raycast");
  setup.range = {0, 255};
  setup.transfer = {.colors = {{0, {1, 1, 1}}}, .opacities = {{0, 0}, {255, 0}}};
  setup.shading.shadows = 1;
  setup.shading.lights = {to_light};
  setup.light = {LightVolumeOf(last), setup.description};
  setup.light->description.geometry = LightGeometry(geometry);
  return scene;
}

Extinction Found(const Scene& scene) {
  const VolumeGeometry& light = scene.setup.light->description.geometry;
  Extinction extinction{.size = light.size, .spacing = light.spacing, .each = UnwrittenVector<float>(CountIn(light.size))};
  std::ranges::fill(extinction.each, 0.0F);
  AddShapes(scene.bytes, scene.setup, extinction);
  return extinction;
}

std::shared_ptr<const FrameLight> Light(const Scene& scene) {
  const auto air = [&](std::size_t) {
    VoxelBlock values = MakeVoxelBlock(scene.setup.light->description.geometry.bounds(), ScalarType::kUint8);
    std::ranges::fill(values.bytes, std::byte{0});
    return values;
  };
  return MakeFrameLight(air, scene.setup, scene.bytes);
}

struct Sides {
  Vec3 normal, u, v;  // unit, at right angles
};
Sides SidesOf(const Vec3& along) {
  const Vec3 normal = Normalized(along);
  const Vec3 u = Normalized(Cross(normal, std::abs(normal.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  return {normal, u, Cross(normal, u)};
}

struct Behind {
  double least = kInf, most = -kInf, mean = 0;
};
// The light that reaches places so far from the middle, against the light's direction, that are up to `radius` beside it.
Behind Reached(const FrameLight& light, const Vec3& to_light, double far, double radius) {
  const Sides sides = SidesOf(to_light);
  Behind behind;
  int count = 0;
  for (double a = -radius; a <= radius; a += 0.7) {
    for (double b = -radius; b <= radius; b += 0.7, ++count) {
      const double at = double(light.At(Vec3{29.5, 29.5, 29.5} - far * sides.normal + a * sides.u + b * sides.v).reached[0]);
      behind = {std::min(behind.least, at), std::max(behind.most, at), behind.mean + at};
    }
  }
  behind.mean /= count;
  return behind;
}

TEST(ShapeShadows, OfAPlaneAreItsOpacityWhateverItsAngle) {
  const unsigned seed = 12;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 24; ++i) {
    const Vec3 along = i < 3    ? Vec3{double(i == 0), double(i == 1), double(i == 2)}
                       : i == 3 ? Vec3{1, 1, 0}
                       : i == 4 ? Vec3{1, 1, 1}
                                : Vec3{normal(random), normal(random), normal(random)};
    const Sides sides = SidesOf(along);
    const double shift = std::uniform_real_distribution(-0.5, 0.5)(random);
    for (const double opacity : {1.0, 0.7, 0.3}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << " plane " << i << " opacity " << opacity);
      Scene scene = Air(kGrid, sides.normal);
      scene.Add(Plane(Vec3{29.5, 29.5, 29.5} + shift * sides.normal, 40 * sides.u, 40 * sides.v, i % 2 == 0 ? 1 : 60),
                {.opacity = opacity});
      const auto light = Light(scene);
      const Behind behind = Reached(*light, sides.normal, 8, 5), before = Reached(*light, sides.normal, -5, 5);
      EXPECT_NEAR(behind.mean, 1 - opacity, i == 4 ? 0.1 : 0.05);  // along the diagonal of the voxels light ripples
      EXPECT_NEAR(behind.least, 1 - opacity, 0.15);
      EXPECT_NEAR(behind.most, 1 - opacity, 0.15);
      EXPECT_GE(before.least, 0.99);
    }
  }
}

// As of matter: the way through it is longer.
TEST(ShapeShadows, OfAPlaneAreDarkerInSlantingLight) {
  for (const double angle : {20.0, 40.0, 55.0}) {
    const double radians = angle * std::numbers::pi / 180;
    const Vec3 to_light = {std::sin(radians), 0, std::cos(radians)};
    Scene scene = Air(kGrid, to_light);
    scene.Add(Plane({29.5, 29.5, 29.5}, {50, 0, 0}, {0, 50, 0}, 7), {.opacity = 0.3});
    EXPECT_NEAR(Reached(*Light(scene), to_light, 8, 4).mean, std::pow(0.7, 1 / std::cos(radians)), 0.02) << angle;
  }
}

// Thin or thick, of long or flat voxels, in pieces or at once: the light that is missing behind it is that of its width.
TEST(ShapeShadows, OfTubesAndBallsHaveTheirWidth) {
  for (const Vec3& spacing : {Vec3{1, 1, 1}, Vec3{1, 1.3, 0.7}}) {
    for (const double opacity : {1.0, 0.4}) {
      for (const float radius : {0.2F, 0.7F, 2.0F, 6.0F}) {
        for (const bool ball : {false, true}) {
          SCOPED_TRACE(::testing::Message() << spacing.y << " opacity " << opacity << " radius " << radius << " ball " << ball);
          Scene scene = Air({{60, 60, 60}, spacing});
          const Vec3 middle = 29.5 * spacing, way = ball ? Vec3{} : spacing * Vec3{17, 6, 5};
          Shape shape{.kind = ball ? ShapeKind::kPoints : ShapeKind::kLines, .origin = middle};
          shape.positions = {ToFloats(-way), ToFloats(way)};
          shape.radii = {radius, radius};
          if (ball) shape.positions.pop_back(), shape.radii.pop_back();
          if (!ball) shape.line_begins = {0, 2};
          scene.Add(shape, {.opacity = opacity});
          const auto light = Light(scene);
          double missing = 0;  // area, behind it
          for (int y = 0; y < 60; ++y) {
            for (int x = 0; x < 60; ++x) missing += spacing.x * spacing.y * (1 - double(light->At({double(x), double(y), 2}).reached[0]));
          }
          const double r = double(radius),
                       area = ball ? std::numbers::pi * r * r : std::numbers::pi * r * r + 4 * r * std::hypot(way.x, way.y);
          // What is opaque ends where a little of it is left, so it is up to half a voxel wider.
          const double wider = opacity == 1 && r > 0.5 ? std::pow(1 + 0.5 * spacing.y / r, ball ? 2 : 1) : 1.4;
          EXPECT_GT(missing / (opacity * area), 0.75);
          EXPECT_LT(missing / (opacity * area), wider);
        }
      }
    }
  }
}

TEST(ShapeShadows, DoNotDependOnThreads) {
  Scene scene = Air({{70, 61, 67}, {1, 1.3, 0.7}});
  scene.Add(SphereMesh({30, 30, 30}, 14, 64), {.opacity = 0.6});
  scene.Add(Plane({30, 30, 30}, {150, 20, 0}, {0, 30, 140}, 1));
  Shape lines{.kind = ShapeKind::kLines, .positions = {{0, 0, 0}, {50, 45, 40}, {20, 60, 20}}, .line_begins = {0}};
  scene.Add(lines, {.width = 2, .width_in_pixels = true});
  TaskArena alone(1), many(8);
  const Extinction expected = alone.Run([&] { return Found(scene); });
  EXPECT_EQ(many.Run([&] { return Found(scene); }).each, expected.each);
  EXPECT_GT(*std::ranges::max_element(expected.each), 1);
}

// Beyond the grid, far larger than it, and numbers that no file has: nothing else happens.
TEST(ShapeShadows, AnyNumbersEndSoon) {
  Scene scene = Air(kGrid);
  scene.Add(Plane({29.5, 29.5, -20}, {30, 0, 0}, {0, 30, 0}, 3));
  scene.Add(Point({29.5, 29.5, 300}, 5));
  for (const float each : Found(scene).each) ASSERT_EQ(each, 0);
  Shape needle{.kind = ShapeKind::kMesh, .positions = {{-3e37F, -3e37F, -3e37F}, {3e37F, 3e37F, 3e37F}, {3e37F, 3.00001e37F, 3e37F}}};
  needle.triangles = {{0, 1, 2}};
  scene.Add(needle);
  scene.Add(Plane({29.5, 29.5, 29.5}, {3e30, 1e30, 0}, {0, 1e30, 3e30}, 1));
  scene.Add({.kind = ShapeKind::kLines, .positions = {{-3e37F, -3e37F, -3e37F}, {3e37F, 3e37F, 3e37F}}, .line_begins = {0}});
  scene.Add(Point({29.5, 29.5, 29.5}, 1e30F));
  const std::size_t whole = scene.bytes.size();
  scene.Add(SphereMesh({30, 30, 30}, 14, 8));
  scene.Add(Point({29.5, 29.5, 29.5}, 5));
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (std::size_t i = whole; i < scene.bytes.size(); ++i) {
    auto copy = std::make_shared<VoxelBlock>(*scene.bytes[i]);
    const ShapeView view = ViewShape(copy->bytes).value();
    const auto at = [&](const float& of) {
      return reinterpret_cast<float*>(copy->bytes.data() + (reinterpret_cast<const std::byte*>(&of) - copy->bytes.data()));
    };
    if (view.radii.empty()) *at(view.positions[0][7]) = nan, *at(view.positions[1][20]) = inf;
    if (!view.radii.empty()) *at(view.radii[0]) = -5;
    scene.bytes[i] = copy;
  }
  for (const float each : Found(scene).each) ASSERT_TRUE(each >= 0 && each < 1e30F) << each;
}

TEST(ShapeShadows, AreMadeAnewIfWhatTakesLightChanges) {
  Scene scene = Air(kGrid);
  const auto none = Light(scene);
  scene.Add(SphereMesh({30, 30, 30}, 14, 24));
  const auto first = Light(scene);
  EXPECT_NE(first, none);
  scene.setup.shapes[0].look.color = {1, 0, 0};
  scene.setup.camera = MakeCamera({.azimuth_degrees = 70}, {200, 200}, kGrid);
  EXPECT_EQ(Light(scene), first) << "colours take no light, and the camera does not matter";
  scene.setup.shapes[0].look.opacity = 0.5;
  EXPECT_NE(Light(scene), first);
  scene.setup.shapes[0].look.opacity = 1;
  EXPECT_EQ(Light(scene), first);
  scene.setup.shapes[0].to_data.offset.x += 3;
  EXPECT_NE(Light(scene), first);
}

// What faces the light has nearly all of it, and what looks away nearly none.
TEST(ShapeShadows, NoSurfaceLiesInItsOwnShadow) {
  for (const bool mesh : {true, false}) {
    for (const Vec3& along : {Vec3{0, 0, 1}, Vec3{1, -2, 0.5}, Vec3{1, -1, 1}, Vec3{-1, -1, 0.2}, Vec3{0.3, 1, 0.4}}) {
      for (const VolumeGeometry& geometry : {VolumeGeometry{{100, 100, 100}}, VolumeGeometry{{300, 200, 250}, {1, 1.5, 1.2}}}) {
        const Vec3 to_light = Normalized(along), centre = 0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1}) * geometry.spacing;
        const double radius = 0.3 * geometry.size.x;
        Scene scene = Air(geometry, to_light);
        scene.setup.shading.model = ShadingModel::kNone;  // colours are shares
        scene.Add(mesh ? SphereMesh(centre, radius, 128) : Point(centre, float(radius)));
        const auto shapes = scene.Draw(Light(scene));
        const FrameMap map = MakeFrameMap(scene.setup);
        double least = 1, most = 0;
        ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
          if (fragments.size() != 1 || fragments[0].rgba[3] < 1) return;
          const FrameMap::Ray ray = map.RayAt(x + 0.5, y + 0.5);
          const Vec3 normal = Normalized(geometry.spacing * (ray.origin + double(fragments[0].depth) * ray.direction) - centre);
          const double facing = Dot(normal, to_light), share = double(fragments[0].rgba[0]);
          if (facing > 0.3) least = std::min(least, share);
          if (facing < -0.5) most = std::max(most, share);
        });
        EXPECT_GT(least, 0.95) << mesh << ' ' << along.x << ' ' << along.y << ' ' << geometry.size.x;
        EXPECT_LT(most, 0.05) << mesh << ' ' << along.x << ' ' << along.y << ' ' << geometry.size.x;
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
