// Colours, light, lines and points.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/view/phong.h"
#include "tests/support/random.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

// The volume's axis y points away from the eye; a pixel is half as wide as a voxel.
FrameSetup Frame(Projection projection = Projection::kOrthographic, bool slices = false) {
  FrameSetup setup = EmptyFrame({{100, 100, 100}}, {.projection = projection}, {200, 200}, slices);
  return setup;
}

std::array<float, 4> ColorAt(const FrameShapes& shapes, int x, int y) {
  const auto fragments = shapes.TileAt(x, y).At(x, y);
  EXPECT_EQ(fragments.size(), 1U);
  return fragments.empty() ? std::array<float, 4>{} : fragments[0].rgba;
}

TEST(ShapeLooks, AreLitByPhong) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    const VolumeGeometry geometry = {{100, 80, 60}, {1, 2, 0.5}, {.axes = {Vec3{0.8, 0.6, 0}, Vec3{-0.6, 0.8, 0}, Vec3{0, 0, 1}}}};
    Scene scene = {EmptyFrame(geometry, {.projection = i % 2 == 0 ? Projection::kOrthographic : Projection::kPerspective}, {60, 60})};
    if (i % 4 > 0) scene.setup.shading.lights = {{random.Real(-1, 1), -1, random.Real(-1, 1)}, {0.3, 0.2, 0.9}};
    if (i % 5 == 4) scene.setup.shading.model = ShadingModel::kNone;
    const Vec3 normal = Normalized(Vec3{random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)});
    Shape shape = Plane(geometry.ToWorld(geometry.centre()), {100, 30, 0}, {0, 0, 100}, 4);
    shape.normals.assign(shape.positions.size(), ToFloats(normal));
    const Rgb color = {float(random.Real(0, 1)), float(random.Real(0, 1)), float(random.Real(0, 1))};
    scene.Add(shape, {.color = color});
    const PhongFactors factors =
        Phong(scene.setup.shading, scene.setup.camera.view_direction).AtNormal(geometry.orientation.FromWorld(normal));
    const auto expected = [&](float c) { return std::clamp(c * factors.diffuse + factors.specular, 0.0F, 1.0F); };
    const auto rgba = ColorAt(*scene.Draw(), 30, 30);
    EXPECT_NEAR(rgba[0], expected(color.r), 2e-3);
    EXPECT_NEAR(rgba[1], expected(color.g), 2e-3);
    EXPECT_NEAR(rgba[2], expected(color.b), 2e-3);
    EXPECT_EQ(rgba[3], 1);
  }
}

Scene Unlit(bool slices = false) {
  Scene scene = {Frame(Projection::kOrthographic, slices)};
  scene.setup.shading.model = ShadingModel::kNone;
  return scene;
}

TEST(ShapeLooks, ShowColorsOfVerticesInPerspective) {
  Scene scene = {Frame(Projection::kPerspective)};
  scene.setup.shading.model = ShadingModel::kNone;
  Shape shape = Plane({50, 50, 50}, {60, 60, 0}, {0, 0, 60}, 1);
  for (const auto& p : shape.positions) shape.colors.push_back({std::uint8_t(p[0] < 0 ? 0 : 255), 51, 0, 255});
  scene.Add(shape, {.coloring = ShapeColoring::kVertices});
  const auto shapes = scene.Draw();
  int seen = 0;
  ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
    if (fragments.empty() || fragments[0].rgba[3] < 1) return;
    const Camera::Ray ray = scene.setup.camera.RayAt(x + 0.5, y + 0.5);
    const Vec3 p = ray.origin + double(fragments[0].depth) * ray.direction;
    EXPECT_NEAR(fragments[0].rgba[0], (p.x - 20) / 60, 1e-3);
    EXPECT_NEAR(fragments[0].rgba[1], 0.2, 1e-5);
    ++seen;
  });
  EXPECT_GT(seen, 1000);
}

TEST(ShapeLooks, ShowValuesByAMap) {
  Scene scene = Unlit();
  Shape shape = Plane({50, 50, 50}, {80, 0, 0}, {0, 0, 80}, 1);
  for (const auto& p : shape.positions) shape.values.push_back(p[0] < 0 ? -40 : 40);
  ShapeLook look = {.coloring = ShapeColoring::kValues, .color = {0, 1, 0}, .low = -20, .high = 20};
  for (std::size_t i = 0; i < kShapeMapColors; ++i) look.map.push_back({float(i) / 255, 0, 1});
  scene.Add(shape, look);
  const auto shapes = scene.Draw();
  ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
    if (fragments.empty() || fragments[0].rgba[3] < 1) return;
    const double value = scene.setup.camera.RayAt(x + 0.5, y + 0.5).origin.x - 50;
    EXPECT_NEAR(fragments[0].rgba[0], std::clamp((value + 20) / 40, 0.0, 1.0), 1e-3);
  });
  Scene none = Unlit();
  shape.values.assign(shape.values.size(), std::numeric_limits<float>::quiet_NaN());
  none.Add(shape, look);
  EXPECT_EQ(ColorAt(*none.Draw(), 100, 100), (std::array<float, 4>{0, 1, 0, 1}));
}

// Values of a plane are bilinear among its samples. It is unlit, and has holes where there is no sample.
TEST(ShapeLooks, ShowValuesOfAPlane) {
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    Scene scene = {Frame(projection)};
    Shape shape = Plane({50, 50, 50}, {60, 30, 0}, {0, 0, 60}, 1);
    shape.plane = {.columns = 61, .rows = 61, .column = {1, 0, 0, 30}, .row = {0, 0, 1, 30}};
    for (int row = 0; row < 61; ++row) {
      for (int column = 0; column < 61; ++column) {
        shape.plane.samples.push_back(row < 10 ? std::numeric_limits<float>::quiet_NaN() : float(column * row));
      }
    }
    ShapeLook look = {.coloring = ShapeColoring::kValues, .low = 0, .high = 3600, .unlit = true};
    for (std::size_t i = 0; i < kShapeMapColors; ++i) look.map.push_back({float(i) / 255, 0, 1});
    scene.Add(shape, look);
    scene.Add(Plane({50, 90, 50}, {100, 0, 0}, {0, 0, 100}, 1), {.color = {0, 1, 0}});
    const auto shapes = scene.Draw();
    int seen = 0, holes = 0;
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      if (fragments.size() != 1 || fragments[0].rgba[3] < 1) return;
      const Camera::Ray ray = scene.setup.camera.RayAt(x + 0.5, y + 0.5);
      const double slope = ray.direction.y - 0.5 * ray.direction.x;  // y = 50 + (x - 50) / 2 on the plane
      const Vec3 p = ray.origin + (50 + 0.5 * (ray.origin.x - 50) - ray.origin.y) / slope * ray.direction;
      const double column = p.x - 20, row = p.z - 20;
      if (std::min(column, 60 - column) < 1 || std::min(row, 60 - row) < 1 || std::abs(row - 9.5) < 1) return;
      if (row < 9) {
        EXPECT_GT(fragments[0].rgba[1], fragments[0].rgba[2]) << "the shape behind shows, which is green";
        ++holes;
      } else {
        EXPECT_NEAR(fragments[0].rgba[0], column * row / 3600, 1e-3);
        EXPECT_EQ(fragments[0].rgba[2], 1);
        ++seen;
      }
    });
    EXPECT_GT(seen, 1000);
    EXPECT_GT(holes, 100);
  }
}

TEST(ShapeLooks, OpacityIsThatOfTheLookTimesThatOfVertices) {
  Scene scene = Unlit();
  Shape shape = Plane({50, 50, 50}, {80, 0, 0}, {0, 0, 80}, 1);
  shape.colors.assign(shape.positions.size(), {255, 0, 0, 51});
  scene.Add(shape, {.coloring = ShapeColoring::kVertices, .opacity = 0.5});
  const auto shapes = scene.Draw();
  EXPECT_TRUE(shapes->translucent());
  const auto rgba = ColorAt(*shapes, 100, 100);
  EXPECT_NEAR(rgba[0], 0.1, 1e-6);
  EXPECT_NEAR(rgba[3], 0.1, 1e-6);
  EXPECT_EQ(shapes->TileAt(100, 100).ends[shapes->TileAt(100, 100).Number(100, 100)], kRayGoesOn);
}

TEST(ShapeLooks, OpaqueShapesHideWhatIsBehind) {
  Scene scene = Unlit();
  scene.Add(Plane({50, 50, 50}, {80, 0, 0}, {0, 0, 80}, 1), {.color = {1, 0, 0}});
  scene.Add(Plane({50, 60, 50}, {80, 0, 0}, {0, 0, 80}, 1), {.color = {0, 1, 0}, .opacity = 0.5});
  scene.Add(Plane({50, 40, 50}, {80, 0, 0}, {0, 0, 80}, 1), {.color = {0, 0, 1}, .opacity = 0.5});
  const auto shapes = scene.Draw();
  const auto fragments = shapes->TileAt(100, 100).At(100, 100);
  ASSERT_EQ(fragments.size(), 2U);
  EXPECT_EQ(fragments[0].rgba, (std::array<float, 4>{0, 0, 0.5, 0.5}));
  EXPECT_EQ(fragments[1].rgba, (std::array<float, 4>{1, 0, 0, 1}));
  const auto depth = [&](double y) { return scene.setup.camera.Project({50, y, 50}).depth; };
  EXPECT_NEAR(fragments[0].depth, depth(40), 1e-3);
  EXPECT_NEAR(fragments[1].depth, depth(50), 1e-3);
}

// Half a pixel of one shape, then another one behind it: their shares add up.
TEST(ShapeLooks, SharesOfAPixelAddUp) {
  Scene scene = Unlit();
  const double pixel = scene.setup.camera.PixelSizeAt(1);
  scene.Add(Plane({49.5 - 40 + 0.5 * pixel, 40, 50}, {80, 0, 0}, {0, 0, 80}, 1), {.color = {1, 0, 0}});
  scene.Add(Plane({50, 60, 50}, {80, 0, 0}, {0, 0, 80}, 1), {.color = {0, 1, 0}});
  const auto shapes = scene.Draw();
  // The vertical line through the centre of the volume is the left border of this pixel.
  const int x = int(std::floor(scene.setup.camera.Project({49.5, 40, 50}).x + 0.5));
  const auto fragments = shapes->TileAt(x, 100).At(x, 100);
  ASSERT_EQ(fragments.size(), 2U);
  EXPECT_EQ(fragments[0].rgba[3], 0.5F);
  EXPECT_EQ(fragments[1].rgba[3], 1);
  const auto all = Composited(fragments);
  EXPECT_NEAR(all[0], 0.5, 1e-6);
  EXPECT_NEAR(all[1], 0.5, 1e-6);
}

Shape StraightLine() {
  Shape shape;
  shape.kind = ShapeKind::kLines;
  shape.positions = {{20, 50, 50}, {40, 50, 50}, {45, 50, 50}, {80, 50, 50}};
  shape.line_begins = {0, 4};
  return shape;
}

TEST(ShapeLooks, LinesAreAsWideAsTheirLookSays) {
  for (const double opacity : {1.0, 0.5}) {
    for (const bool in_pixels : {true, false}) {
      Scene scene = Unlit();
      const double pixel = scene.setup.camera.PixelSizeAt(1), width = in_pixels ? 6 : 6 * pixel;
      scene.Add(StraightLine(), {.opacity = opacity, .width = width, .width_in_pixels = in_pixels});
      const auto shapes = scene.Draw();
      EXPECT_NEAR(Coverage(scene.setup, *shapes) / opacity / (60 / pixel * 6 + std::numbers::pi * 9), 1, 0.01);
      const auto fragments = shapes->TileAt(100, 99).At(100, 99);
      ASSERT_EQ(fragments.size(), 1U);
      EXPECT_NEAR(fragments[0].rgba[3], opacity, 1e-6);
      EXPECT_NEAR(fragments[0].depth, scene.setup.camera.Project({50, 50, 50}).depth - 3 * pixel, 0.1);
    }
  }
}

TEST(ShapeLooks, WidthsInPixelsAreThoseOfTheFinishedPicture) {
  for (const bool slices : {false, true}) {
    Scene scene = Unlit(slices);
    scene.Add(StraightLine(), {.width = 6, .width_in_pixels = true});
    const auto shapes = scene.Draw();
    int covered = 0;
    const SlicePlacement slice = PlaceSlice(scene.setup.sheets, 50);
    const int column = slices ? int(slice.scale_u * 60 + slice.offset_u) : int(scene.setup.camera.Project({60, 50, 50}).x);
    const double rows = slices ? slice.scale_v * 6 * scene.setup.camera.PixelSizeAt(1) : 6;
    for (int y = 0; y < FrameBounds(scene.setup).height(); ++y) {
      if (Composited(shapes->TileAt(column, y).At(column, y))[3] > 0) ++covered;
    }
    EXPECT_NEAR(covered, rows, 2);
  }
  Scene scene = {EmptyFrame({{100, 100, 100}}, {.zoom = 0.1}, {200, 200})};
  scene.setup.camera = MakeCamera({.zoom = 0.1}, {200, 200}, {{100, 100, 100}}, 1);
  ASSERT_GT(scene.setup.camera.supersample, 1);
  Shape point = Point({50, 50, 50}, 0);
  scene.Add(point, {.width = 10, .width_in_pixels = true});
  const double side = scene.setup.camera.supersample;
  EXPECT_NEAR(Coverage(scene.setup, *scene.Draw()) / (side * side), std::numbers::pi * 25, 1);
}

TEST(ShapeLooks, RadiiOfVerticesMakeConesAndBalls) {
  Scene scene = Unlit();
  Shape shape = StraightLine();
  shape.positions = {{20, 50, 50}, {80, 50, 50}};
  shape.line_begins = {0, 2};
  shape.radii = {2, 12};
  scene.Add(shape);
  const auto shapes = scene.Draw();
  const double pixel = scene.setup.camera.PixelSizeAt(1);
  for (const double x : {25.0, 40.0, 60.0, 75.0}) {
    const int column = int(scene.setup.camera.Project({x, 50, 50}).x);
    double covered = 0;
    for (int y = 0; y < 200; ++y) covered += Composited(shapes->TileAt(column, y).At(column, y))[3];
    // The half-width at x of the common tangent of two circles.
    const double sine = 10.0 / 60, cosine = std::sqrt(1 - sine * sine), half = (2 + (x - 20) * sine) / cosine;
    EXPECT_NEAR(covered * pixel, 2 * half, 0.7) << x;
  }
}

// Shadows and ambient occlusion: half of all light is left.
TEST(ShapeLooks, SharesOfLightDarken) {
  auto light = std::make_shared<FrameLight>();
  light->size = {2, 2, 2};
  light->lights = 1;
  light->scale = {0.01F, 0.01F, 0.01F};
  light->stride = {2, 6, 18};
  light->light = 54;
  light->shares.resize(54 + FrameLight::kSharesPadding);
  for (std::size_t i = 0; i < 27; ++i) {
    light->shares[2 * i] = 255;
    light->shares[2 * i + 1] = 102;
  }
  for (const ShadingModel model : {ShadingModel::kPhong, ShadingModel::kNone}) {
    Scene scene = {Frame()};
    scene.setup.shading.model = model;
    scene.setup.shading.shadows = 1;
    Shape shape = Plane({50, 50, 50}, {80, 0, 0}, {0, 0, 80}, 1);
    scene.Add(shape, {.color = {0.5, 0.5, 0.5}});
    const auto rgba = ColorAt(*scene.Draw(light), 100, 100);
    const auto [ambient, diffuse, specular, shininess] = scene.setup.shading.On();
    const float expected = model == ShadingModel::kNone ? 0.5F * 0.4F : 0.5F * (ambient + diffuse * 0.4F) + specular * 0.4F;
    EXPECT_NEAR(rgba[0], expected, 1e-3);
  }
}

}  // namespace
}  // namespace slabstream
