// Which of shapes and volume pixels show, by equation, by each renderer's rule, and as the picture's fragments say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "coordinator/probe/met_shapes.h"
#include "coordinator/probe/pick.h"
#include "tests/coordinator/probe/picked_scene.h"
#include "tests/support/random_volume.h"
#include "tests/support/renderers.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

TransferFunction Opacities(std::vector<OpacityPoint> opacities) {
  return {.colors = {{0, {1, 1, 1}}}, .opacities = std::move(opacities), .opacity_distance = 1};
}

// A volume, and shapes beside it.
struct Picture {
  Volume volume;
  Scene scene;

  Picture(Volume of, const char* renderer, const TransferFunction& transfer, const ViewParameters& view, ImageSize size = {64, 64})
      : volume(std::move(of)) {
    FrameSetup& setup = scene.setup;
    setup.description = volume.description;
    setup.range = Summarize(volume).range;
    SetRenderer(*FindRenderer(renderer), setup);
    SetView(view, size, setup);
    setup.transfer = transfer;
  }

  Camera::Ray RayAt(double x, double y) const {
    const int s = scene.setup.camera.supersample;
    return scene.setup.camera.RayAt(x * s, y * s);
  }
  std::optional<Picked> PickAt(double x, double y) const {
    return Pick(scene.setup, {.voxels = VoxelBricks(volume.block)}, x, y, ViewsOf(scene));
  }
  // Where this point of data space is seen.
  std::optional<Picked> PickAt(const Vec3& p) const {
    const Camera::ImagePoint at = scene.setup.camera.Project(p);
    const int s = scene.setup.camera.supersample;
    return PickAt(at.x / s, at.y / s);
  }
};

Volume Block(double value) {
  return MakeVolume({{24, 24, 24}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3&) { return value; });
}

Shape Sheet(double y, double side = 400) { return Plane({11.5, y, 11.5}, {side, 0, 0}, {0, 0, side}, 3); }

std::optional<std::uint32_t> ShapeOf(const std::optional<Picked>& picked) { return picked ? picked->shape : std::nullopt; }

// Sheets in fog whose extinction is k for each unit of length: light falls by exp(-k length), and by 1 - opacity at each sheet.
TEST(PickShapes, HalfOfTheLightIsLostByTheEquation) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  int of_shapes = 0, of_fog = 0, of_none = 0;
  for (int i = 0; i < 150; ++i) {
    const double fog = random.Chance(0.2) ? 0 : random.Real(0.002, 0.15), k = -std::log1p(-fog);
    const ViewParameters view = {.projection = i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective,
                                 .azimuth_degrees = random.Real(-50, 50),
                                 .elevation_degrees = random.Real(-40, 40)};
    Picture picture(Block(1), random.Chance(0.5) ? "raycast" : "splat", Opacities({{0, fog}}), view);
    struct SheetAt {
      double y, opacity;
    };
    std::vector<SheetAt> sheets(random.Integer<std::size_t>(0, 5));
    for (SheetAt& sheet : sheets) {
      sheet = {random.Real(-20, 45), random.Chance(0.2) ? 1.0 : random.Real(0.02, 0.6)};
      picture.scene.Add(Sheet(sheet.y), {.opacity = sheet.opacity});
    }
    for (int n = 0; n < 10; ++n) {
      const double x = random.Real(10, 54), y = random.Real(10, 54);
      const Camera::Ray ray = picture.RayAt(x, y);
      const double length = Length(ray.direction);
      double enter = -kNone, leave = kNone;
      for (const Axis axis : kAxes) {
        const double a = (-0.5 - ray.origin[axis]) / ray.direction[axis], b = (23.5 - ray.origin[axis]) / ray.direction[axis];
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
      }
      const auto depth_of = [&](std::size_t s) { return (sheets[s].y - ray.origin.y) / ray.direction.y; };
      std::vector<std::size_t> order(sheets.size());
      for (std::size_t s = 0; s < order.size(); ++s) order[s] = s;
      std::ranges::sort(order, {}, depth_of);

      double left = 1, at = enter;
      std::optional<double> expected;
      std::optional<std::uint32_t> of_shape;
      const auto pass_fog = [&](double until) {
        const double end = std::min(until, leave);
        if (expected || !(end > at)) return;
        const double through = left * std::exp(-k * (end - at) * length);
        if (through <= 0.5) expected = at + std::log(2 * left) / (k * length);
        left = through;
        at = end;
      };
      for (const std::size_t s : order) {
        pass_fog(depth_of(s));
        left *= 1 - sheets[s].opacity;
        if (expected || left > 0.5) continue;
        expected = depth_of(s);
        of_shape = std::uint32_t(s);
      }
      pass_fog(kNone);

      const auto picked = picture.PickAt(x, y);
      SCOPED_TRACE(::testing::Message() << "fog " << fog << ", " << sheets.size() << " sheets, pixel " << x << ", " << y);
      ASSERT_EQ(picked.has_value(), expected.has_value());
      ++(!expected ? of_none : of_shape ? of_shapes : of_fog);
      if (!expected) continue;
      EXPECT_EQ(picked->shape, of_shape);
      EXPECT_NEAR(picked->depth, *expected, of_shape ? 1e-5 : 0.02 / length);
      const Camera::ImagePoint back = picture.scene.setup.camera.Project(picked->at);
      EXPECT_NEAR(back.depth, picked->depth, 1e-9);
    }
  }
  EXPECT_GT(of_shapes, 200);
  EXPECT_GT(of_fog, 100);
  EXPECT_GT(of_none, 50);
}

TEST(PickShapes, BallsAreHitWhereRaysEnterThem) {
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    Picture picture(MakeVolume(Turned(), ScalarType::kUint8, [](const Index3&) { return 0; }), "raycast", Opacities({{0, 0}}),
                    {.projection = projection, .azimuth_degrees = 70, .elevation_degrees = 35});
    const VolumeGeometry& geometry = picture.volume.description.geometry;
    const Vec3 centre = geometry.ToWorld({40, 25, 20});
    constexpr double kRadius = 14;
    picture.scene.Add(Point(centre, float(kRadius)));
    int hits = 0;
    for (int y = 0; y < 64; y += 3) {
      for (int x = 0; x < 64; x += 3) {
        const Camera::Ray ray = picture.RayAt(x, y);
        const Vec3 from = geometry.ToWorld(ray.origin) - centre, along = geometry.ToWorld(ray.origin + ray.direction) - centre - from;
        const double a = Dot(along, along), b = Dot(from, along), root = b * b - a * (Dot(from, from) - kRadius * kRadius);
        if (std::abs(root) < 1e-6) continue;
        const auto picked = picture.PickAt(x, y);
        ASSERT_EQ(picked.has_value(), root > 0);
        if (root < 0) continue;
        ++hits;
        EXPECT_NEAR(picked->depth, (-b - std::sqrt(root)) / a, 1e-8);
        EXPECT_NEAR(Length(geometry.ToWorld(picked->at) - centre), kRadius, 1e-8);
      }
    }
    EXPECT_GT(hits, 20);
  }
}

TEST(PickShapes, VoxelsAreThoseThatHoldThePointOrOutside) {
  Picture picture(Block(1), "raycast", Opacities({{0, 0}}), {.azimuth_degrees = 0});
  const Box bounds = picture.volume.description.geometry.bounds();
  for (const double y : {-30.0, 7.3, 60.0}) {
    picture.scene.setup.shapes.clear();
    picture.scene.bytes.clear();
    picture.scene.Add(Sheet(y));
    const auto picked = picture.PickAt(Vec3{5.2, y, 9.9});
    ASSERT_TRUE(picked);
    EXPECT_EQ(picked->shape, 0U);
    EXPECT_NEAR(picked->at.y, y, 1e-6);
    EXPECT_EQ(bounds.Contains(picked->voxel), y == 7.3);
    if (y == 7.3) {
      EXPECT_EQ(picked->voxel, (Index3{5, 7, 10}));
    }
    // Beside the volume, too.
    EXPECT_EQ(ShapeOf(picture.PickAt(0.5, 0.5)), 0U);
  }
}

TEST(PickShapes, ClippingLeavesThem) {
  Picture picture(Block(1), "raycast", Opacities({{0, 0.9}}), {.azimuth_degrees = 0});
  picture.scene.Add(Sheet(10));
  const Vec3 middle = {11.5, 10, 11.5};
  EXPECT_EQ(ShapeOf(picture.PickAt(middle)), std::nullopt) << "it lies in fog";
  Clipping clipping;
  clipping.box = ClipBox{{-1e9, 12, -1e9}, {1e9, 1e9, 1e9}};
  picture.scene.setup.clip = MakeClipRegion(clipping, picture.volume.description.geometry).value();
  EXPECT_EQ(ShapeOf(picture.PickAt(middle)), 0U) << "the fog in front of it is clipped away";
}

TEST(PickShapes, SurfacesHideWhatLiesBehind) {
  const auto pick = [](const std::vector<std::pair<double, double>>& sheets, double value) {
    Picture picture(Block(value), "zbuffer", Opacities({{0, 0}, {1, 1}}), {.azimuth_degrees = 0});
    for (const auto& [y, opacity] : sheets) picture.scene.Add(Sheet(y), {.opacity = opacity});
    return picture.PickAt(Vec3{11.5, 11.5, 11.5});
  };
  EXPECT_EQ(ShapeOf(pick({{-5, 1}}, 1)), 0U);
  EXPECT_EQ(ShapeOf(pick({{-5, 0.5}}, 1)), 0U);
  const auto surface = pick({{-5, 0.4}}, 1);
  ASSERT_TRUE(surface);
  EXPECT_FALSE(surface->shape);
  EXPECT_NEAR(surface->at.y, -0.5, 1e-9);
  EXPECT_EQ(ShapeOf(pick({{-5, 0.3}, {-9, 0.3}}, 1)), 0U) << "the farther one of the two";
  EXPECT_EQ(ShapeOf(pick({{5, 1}}, 1)), std::nullopt) << "it lies in the block";
  EXPECT_EQ(ShapeOf(pick({{5, 1}}, 0)), 0U) << "the block does not show";
  EXPECT_EQ(ShapeOf(pick({{-5, 0.3}, {5, 0.4}}, 0)), 1U);
  EXPECT_FALSE(pick({{-5, 0.2}, {5, 0.2}}, 0));
}

// One voxel is bright, the others are dark. A projection is drawn over shapes.
TEST(PickShapes, ProjectionsShowTheirExtremeInFrontOfOpaqueShapes) {
  const Vec3 bright = {12, 9, 12};
  // The opacity of bright voxels, and of dark ones.
  const auto pick = [&](std::vector<double> parameters, double of_bright, double of_dark,
                        const std::vector<std::pair<double, double>>& sheets) {
    const Volume volume =
        MakeVolume({{24, 24, 24}, {1, 1, 1}}, ScalarType::kUint8, [&](const Index3& voxel) { return ToVec3(voxel) == bright ? 200 : 100; });
    Picture picture(volume, "mip", Opacities({{0, 0}, {99, of_dark}, {120, of_dark}, {199, of_bright}}), {.azimuth_degrees = 0});
    SetParameters(std::move(parameters), picture.scene.setup);
    for (const auto& [y, opacity] : sheets) picture.scene.Add(Sheet(y), {.opacity = opacity});
    return picture.PickAt(bright);
  };
  const std::vector<double> largest = {1, 0, 0}, least = {1, 1, 0}, mean = {1, 2, 0};
  const auto is_bright = [&](const std::optional<Picked>& picked) { return picked && !picked->shape && Length(picked->at - bright) < 0.3; };
  EXPECT_TRUE(is_bright(pick(largest, 1, 0, {})));
  EXPECT_TRUE(is_bright(pick(largest, 1, 0, {{20, 1}}))) << "it is drawn over the sheet";
  EXPECT_TRUE(is_bright(pick(largest, 0.3, 0, {}))) << "the pixel shows nothing else";
  EXPECT_EQ(ShapeOf(pick(largest, 0.3, 0, {{20, 1}})), 0U) << "the sheet shows through";
  EXPECT_EQ(ShapeOf(pick(largest, 0.3, 0, {{20, 0.2}, {-9, 0.2}})), 0U) << "0.7 x 0.8 x 0.8 < 1/2: the hindmost";
  EXPECT_TRUE(is_bright(pick(largest, 0.3, 0, {{20, 0.2}}))) << "0.7 x 0.8 > 1/2";
  EXPECT_TRUE(is_bright(pick(largest, 1, 0, {{-9, 0.9}}))) << "translucent shapes lie behind projections";
  EXPECT_EQ(ShapeOf(pick(largest, 1, 0, {{5, 1}})), 0U) << "in front of the sheet all is dark";
  const auto dark = pick(largest, 1, 0.8, {{5, 1}});
  ASSERT_TRUE(dark);
  EXPECT_FALSE(dark->shape) << "what is dark shows, too";
  EXPECT_LT(dark->at.y, 5);
  EXPECT_EQ(ShapeOf(pick(largest, 1, 1, {{-5, 1}})), 0U) << "the ray does not reach the volume";
  EXPECT_EQ(ShapeOf(pick(least, 1, 0, {{20, 1}})), 0U);
  EXPECT_EQ(ShapeOf(pick(least, 1, 1, {{20, 1}})), std::nullopt);
  EXPECT_EQ(ShapeOf(pick(mean, 0, 0, {{20, 1}})), 0U);
  EXPECT_FALSE(pick(mean, 0.9, 0.9, {{20, 1}})) << "no point has the mean";
}

TEST(PickShapes, RadiographsHideWhatLiesInTheVolumeAndBehind) {
  const auto pick = [](double y, double x, double z) {
    Picture picture(Block(1), "xray", {}, {.azimuth_degrees = 0});
    picture.scene.Add(Sheet(y));
    return picture.PickAt(Vec3{x, y, z});
  };
  EXPECT_EQ(ShapeOf(pick(-5, 11.5, 11.5)), 0U);
  EXPECT_FALSE(pick(12, 11.5, 11.5));
  EXPECT_EQ(ShapeOf(pick(12, -4, 11.5)), 0U) << "beside the volume";
}

// Triangles, tubes and balls, each a shape of its own. Where all samples of a pixel see the same of them, it has a fragment of each.
TEST(PickShapes, DepthsAreThoseOfThePicture) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  int compared = 0, different = 0;
  for (int i = 0; i < 8; ++i) {
    const auto nothing = MakeVolume({{40, 40, 40}, {1, 1, 1}}, ScalarType::kUint8, [](const Index3&) { return 0; });
    Picture picture(nothing, "raycast", Opacities({{0, 0}}), RandomView(random), i % 4 == 3 ? ImageSize{32, 24} : ImageSize{80, 60});
    Scene& scene = picture.scene;
    const auto points = [&](int count) {
      std::vector<std::array<float, 3>> all;
      for (int n = 0; n < count; ++n) all.push_back({float(random.Real(0, 40)), float(random.Real(0, 40)), float(random.Real(0, 40))});
      return all;
    };
    for (const double opacity : {1.0, 0.35, 0.2, 0.5, 1.0, 0.1, 0.3}) {
      scene.Add({.positions = points(3), .triangles = {{0, 1, 2}}}, {.opacity = opacity});
      scene.Add({.kind = ShapeKind::kLines, .positions = points(2), .line_begins = {0, 2}}, {.opacity = opacity, .width = 3});
      scene.Add({.kind = ShapeKind::kPoints, .positions = points(1)}, {.opacity = opacity, .width = 9, .width_in_pixels = true});
    }
    const auto shapes = scene.Draw();
    const std::vector<ShapeView> views = ViewsOf(scene);
    const double side = 1.0 / scene.setup.camera.supersample;  // of a pixel of the frame
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      const auto meet = [&](double dx, double dy) {
        return MeetShapes(scene.setup, views, picture.RayAt(side * (x + dx), side * (y + dy)));
      };
      const std::vector<MetShape> met = meet(0.5, 0.5);
      double slope = 0;  // of surfaces, to the samples
      for (const auto& [dx, dy] : {std::pair(96, 32), std::pair(224, 96), std::pair(32, 160), std::pair(160, 224)}) {
        const std::vector<MetShape> sample = meet(dx / 256.0, dy / 256.0);
        if (!std::ranges::equal(met, sample, {}, &MetShape::shape, &MetShape::shape)) return;
        for (std::size_t n = 0; n < met.size(); ++n) slope = std::max(slope, std::abs(met[n].depth - sample[n].depth));
      }
      // The picture rounds vertices of meshes to 1/256 of a pixel, so few samples are on the other side of an edge.
      const auto same = [](const MetShape& shape, const ShapeFragment& fragment) {
        return std::abs(shape.opacity - double(fragment.rgba[3])) < 1e-6;
      };
      ++compared;
      const bool all_same = std::ranges::equal(met, fragments, same);
      different += all_same ? 0 : 1;
      if (!all_same || slope > 1) return;
      const auto picked = picture.PickAt(side * (x + 0.5), side * (y + 0.5));
      double left = 1;
      for (std::size_t n = 0; n < met.size(); ++n) {
        ASSERT_NEAR(met[n].depth, double(fragments[n].depth), 1e-4 + slope / 100) << x << ", " << y << " of frame " << i;
        if (left > 0.5 && left * (1 - met[n].opacity) <= 0.5) {
          ASSERT_TRUE(picked);
          EXPECT_EQ(picked->depth, met[n].depth);
        }
        left *= 1 - met[n].opacity;
      }
      EXPECT_EQ(picked.has_value(), left <= 0.5);
    });
  }
  EXPECT_GT(compared, 15000);
  EXPECT_LT(different, compared / 500);
}

}  // namespace
}  // namespace slabstream
