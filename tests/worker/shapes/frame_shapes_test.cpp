// What pixels see of shapes, against closed forms.
#include "worker/shapes/frame_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "common/parallel/parallel.h"
#include "common/parallel/task_arena.h"
#include "tests/support/random.h"
#include "tests/support/simd_targets.h"
#include "tests/worker/shapes/shape_pictures.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr Projection kProjections[] = {Projection::kOrthographic, Projection::kPerspective};

VolumeGeometry Turned() {
  const double c = std::cos(0.4), s = std::sin(0.4);
  return {{60, 40, 50}, {1, 1.7, 0.6}, {.origin = {100, -50, 7}, .axes = {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}}};
}

ViewParameters View(Projection projection, double azimuth = 30, double elevation = 20) {
  return {.projection = projection, .azimuth_degrees = azimuth, .elevation_degrees = elevation};
}

Vec3 CentreOf(const FrameSetup& setup) {
  const VolumeGeometry& geometry = setup.description.geometry;
  return geometry.ToWorld(geometry.centre());
}

struct WorldRay {
  Vec3 origin, direction;
};
WorldRay RayOf(const FrameSetup& setup, double x, double y) {
  const Camera::Ray ray = setup.camera.RayAt(x, y);
  const VolumeGeometry& geometry = setup.description.geometry;
  const Vec3 origin = geometry.ToWorld(ray.origin);
  return {origin, geometry.ToWorld(ray.origin + ray.direction) - origin};
}

TEST(FrameShapes, PlanesHaveTheDepthsOfTheirRays) {
  for (const Projection projection : kProjections) {
    for (const std::uint32_t n : {1U, 7U, 200U}) {
      for (const VolumeGeometry& geometry : {VolumeGeometry{{40, 40, 40}}, Turned()}) {
        Scene scene = {EmptyFrame(geometry, View(projection), {150, 130})};
        const double size = 2 * BoundingRadius(geometry);
        const Vec3 centre = CentreOf(scene.setup), a = {0.5 * size, 0.1 * size, 0}, b = {-0.1 * size, 0.2 * size, 0.4 * size};
        scene.Add(Plane(centre, a, b, n));
        const auto shapes = scene.Draw();
        int covered = 0;
        ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
          if (fragments.empty()) return;
          const auto [origin, direction] = RayOf(scene.setup, x + 0.5, y + 0.5);
          const Vec3 normal = Cross(a, b);
          const double depth = Dot(centre - origin, normal) / Dot(direction, normal);
          ASSERT_EQ(fragments.size(), 1U) << x << ", " << y;
          EXPECT_NEAR(fragments[0].depth, depth, 1e-4 * size) << x << ", " << y;
          if (fragments[0].rgba[3] == 1) ++covered;
        });
        EXPECT_GT(covered, 1000);
      }
    }
  }
}

// Balls in a frame along slices are where the picture that is resampled from it shows them.
TEST(FrameShapes, SlicesShowWhatTheCameraShows) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  const VolumeGeometry geometry = Turned();
  for (int i = 0; i < 60; ++i) {
    Scene scene = {EmptyFrame(geometry, View(kProjections[i % 2], random.Real(0, 360), random.Real(-80, 80)), {120, 120}, true)};
    const Camera& camera = scene.setup.camera;
    const Vec3 p = {random.Real(0, 59), random.Real(0, 39), random.Real(0, 49)};
    scene.Add(Point(geometry.ToWorld(p), 3));
    const auto [x, y, depth] = camera.Project(p);
    const auto& m = scene.setup.sheets.from_picture;
    const double w = m[6] * x + m[7] * y + m[8];
    const int column = int((m[0] * x + m[1] * y + m[2]) / w), row = int((m[3] * x + m[4] * y + m[5]) / w);
    const auto shapes = scene.Draw();
    const auto fragments = shapes->TileAt(column, row).At(column, row);
    ASSERT_FALSE(fragments.empty());
    const double k = (camera.ascending ? 1 : -1) * p[camera.traversal_axis], slices = 3 / geometry.spacing[camera.traversal_axis];
    EXPECT_LT(fragments[0].depth, k);
    EXPECT_GT(fragments[0].depth, k - slices);
  }
}

// Each pixel has the depth of the plane on its own ray.
TEST(FrameShapes, SlicesHaveExactDepths) {
  for (const Projection projection : kProjections) {
    const VolumeGeometry geometry = Turned();
    Scene scene = {EmptyFrame(geometry, View(projection, 200, 25), {120, 120}, true)};
    const SheetGrid& grid = scene.setup.sheets;
    const auto [c, u_axis, v_axis] = AxesOf(scene.setup.camera.traversal_axis);
    const Vec3 centre = CentreOf(scene.setup), a = {30, 10, 3}, b = {-10, 5, 20};
    scene.Add(Plane(centre, a, b, 9));
    const auto shapes = scene.Draw();
    int seen = 0;
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      if (fragments.empty()) return;
      const double k = std::abs(double(fragments[0].depth)), w = grid.w_c * k + grid.w_0;
      Vec3 p;
      p[c] = k;
      p[u_axis] = ((x + 0.5) * w - grid.x_c * k - grid.x_0) / grid.x_u;
      p[v_axis] = ((y + 0.5) * w - grid.y_c * k - grid.y_0) / grid.y_v;
      EXPECT_EQ(fragments[0].depth < 0, !scene.setup.camera.ascending);
      EXPECT_NEAR(Dot(geometry.ToWorld(p) - centre, Normalized(Cross(a, b))), 0, 2e-3);
      ++seen;
    });
    EXPECT_GT(seen, 500);
  }
}

TEST(FrameShapes, BallsHaveTheirDepthAndSilhouette) {
  for (const Projection projection : kProjections) {
    Scene scene = {EmptyFrame(Turned(), View(projection), {200, 200})};
    const Vec3 centre = CentreOf(scene.setup);
    const double radius = 15;
    scene.Add(Point(centre, float(radius)));
    const auto shapes = scene.Draw();
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      if (fragments.empty() || fragments[0].rgba[3] < 1) return;
      const auto [origin, direction] = RayOf(scene.setup, x + 0.5, y + 0.5);
      EXPECT_NEAR(Length(origin + double(fragments[0].depth) * direction - centre), radius, 1e-2);
    });
    const double distance = scene.setup.camera.target_depth, pixel = scene.setup.camera.PixelSizeAt(1);
    const double seen = projection == Projection::kPerspective ? radius / std::sqrt(distance * distance - radius * radius) : radius;
    EXPECT_NEAR(Coverage(scene.setup, *shapes) / (std::numbers::pi * seen * seen / (pixel * pixel)), 1, 0.01);

    Scene mesh = {scene.setup};
    mesh.setup.shapes.clear();
    mesh.Add(SphereMesh(centre, radius, 400));
    const auto fine = mesh.Draw();
    EXPECT_NEAR(Coverage(mesh.setup, *fine) / Coverage(scene.setup, *shapes), 1, 2e-3);
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      if (fragments.empty() || fragments[0].rgba[3] < 1) return;
      const auto other = fine->TileAt(x, y).At(x, y);
      ASSERT_FALSE(other.empty());
      // Where the surface turns away, its depth changes by much within a pixel.
      const auto [origin, direction] = RayOf(scene.setup, x + 0.5, y + 0.5);
      const Vec3 normal = (1 / radius) * (origin + double(fragments[0].depth) * direction - centre);
      if (std::abs(Dot(normal, Normalized(direction))) < 0.5) return;
      EXPECT_NEAR(other[0].depth, fragments[0].depth, 0.02);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(other[0].rgba[c], fragments[0].rgba[c], 0.03);
    });
  }
}

TEST(FrameShapes, CoverageAddsUpToTheAreaOfTriangles) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kOrthographic, 0, 0), {200, 200})};
    Shape shape;
    std::array<Camera::ImagePoint, 3> at;
    for (std::size_t v = 0; v < 3; ++v) {
      const Vec3 p = {random.Real(0, 99), random.Real(0, 99), random.Real(0, 99)};
      shape.positions.push_back(ToFloats(p));
      at[v] = scene.setup.camera.Project(p);
    }
    shape.triangles = {{0, 1, 2}};
    const double area = 0.5 * std::abs((at[1].x - at[0].x) * (at[2].y - at[0].y) - (at[2].x - at[0].x) * (at[1].y - at[0].y));
    if (area < 400) continue;
    scene.Add(shape);
    EXPECT_NEAR(Coverage(scene.setup, *scene.Draw()) / area, 1, 0.01);
    scene.setup.camera.supersample = 2;  // one sample
    EXPECT_NEAR(Coverage(scene.setup, *scene.Draw()) / area, 1, 0.03);
  }
}

// A translucent plane of many triangles, in whose border and vertices no sample is seen twice or never.
TEST(FrameShapes, HasNeitherCracksNorOverlaps) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 24; ++i) {
    const Projection projection = kProjections[i % 2];
    Scene scene = {EmptyFrame({{100, 100, 100}}, View(projection, i < 4 ? 0 : random.Real(0, 360), i < 4 ? 0 : random.Real(-80, 80)),
                              {128, 128}, i % 3 == 2)};
    const Camera& camera = scene.setup.camera;
    const Vec3 right = camera.right, up = camera.up + random.Real(-0.5, 0.5) * camera.view_direction;
    const auto n = std::uint32_t(random.Integer(1, 90));
    Shape shape = Plane(CentreOf(scene.setup), 300 * right, 300 * up, n);
    // Inner vertices move within the plane, or lie just at pixel corners and samples.
    for (std::uint32_t y = 1; y < n; ++y) {
      for (std::uint32_t x = 1; x < n; ++x) {
        auto& p = shape.positions[y * (n + 1) + x];
        const Vec3 moved = i < 8 ? Vec3{} : (300.0 / n) * (random.Real(-0.3, 0.3) * right + random.Real(-0.3, 0.3) * up);
        p = ToFloats(Vec3{double(p[0]), double(p[1]), double(p[2])} + moved);
      }
    }
    for (std::size_t t = shape.triangles.size() - 1; t > 0; --t)
      std::swap(shape.triangles[t], shape.triangles[random.Integer<std::size_t>(0, t)]);
    scene.Add(shape, {.opacity = 0.25});
    const auto shapes = scene.Draw();
    EXPECT_TRUE(shapes->translucent());
    ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
      ASSERT_EQ(fragments.size(), 1U) << x << ", " << y << " of frame " << i;
      ASSERT_EQ(fragments[0].rgba[3], 0.25F) << x << ", " << y << " of frame " << i;
    });
  }
}

// All fragments, whatever drew them.
std::vector<ShapeFragment> FragmentsOf(const Scene& scene, const FrameShapes& shapes) {
  std::vector<ShapeFragment> all;
  ForEachPixel(scene.setup, shapes, [&](int, int, std::span<const ShapeFragment> fragments) {
    all.insert(all.end(), fragments.begin(), fragments.end());
    all.push_back({});
  });
  return all;
}

Shape RandomMesh(Random& random, std::size_t triangles, double size) {
  Shape shape;
  for (std::size_t i = 0; i < triangles; ++i) {
    const Vec3 at = {random.Real(-20, 120), random.Real(-20, 120), random.Real(-20, 120)};
    for (std::uint32_t v = 0; v < 3; ++v) {
      shape.positions.push_back(ToFloats(at + Vec3{random.Real(-size, size), random.Real(-size, size), random.Real(-size, size)}));
      shape.colors.push_back({std::uint8_t(random.Integer(0, 255)), 100, 200, 255});
    }
    shape.triangles.push_back({std::uint32_t(3 * i), std::uint32_t(3 * i + 1), std::uint32_t(3 * i + 2)});
  }
  return shape;
}

Scene RandomScene(Random& random, Projection projection, bool slices) {
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(projection), {200, 150}, slices)};
  scene.Add(RandomMesh(random, 2000, 4), {.coloring = ShapeColoring::kVertices});
  scene.Add(RandomMesh(random, 20, 80), {.coloring = ShapeColoring::kVertices});
  scene.Add(RandomMesh(random, 300, 15), {.coloring = ShapeColoring::kVertices, .opacity = 0.4});
  scene.Add(SphereMesh({50, 50, 50}, 30, 300), {.color = {1, 0.5, 0}});
  Shape lines;
  lines.kind = ShapeKind::kLines;
  for (int i = 0; i < 60; ++i)
    lines.positions.push_back({float(random.Real(0, 100)), float(random.Real(0, 100)), float(random.Real(0, 100))});
  lines.line_begins = {0, 20, 50, 60};
  scene.Add(lines, {.color = {0, 1, 0}, .opacity = 0.5});
  lines.kind = ShapeKind::kPoints;
  lines.line_begins = {};
  scene.Add(lines, {.color = {0, 0, 1}, .width = 4});
  return scene;
}

TEST(FrameShapes, DoesNotDependOnThreadsTilesTargetsOrTheOrderOfTriangles) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (const bool slices : {false, true}) {
    for (const Projection projection : kProjections) {
      Scene scene = RandomScene(random, projection, slices);
      const auto expected = FragmentsOf(scene, *scene.Draw());
      EXPECT_GT(expected.size(), 150U * 200U);
      for (const int threads : {1, 2, 8}) {
        TaskArena arena(threads);
        arena.Run([&] {
          const auto shapes = scene.Draw();
          const PixelBounds frame = FrameBounds(scene.setup);
          std::vector<std::int64_t> order;
          for (std::int64_t i = 0; i < frame.pixel_count(); i += 37) order.push_back(i);
          for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[random.Integer<std::size_t>(0, i)]);
          ParallelFor(std::size_t{0}, order.size(), [&](std::size_t i) {
            (void)shapes->TileAt(std::int32_t(order[i] % frame.width()), std::int32_t(order[i] / frame.width()));
          });
          EXPECT_EQ(FragmentsOf(scene, *shapes), expected);
        });
      }
      ForEachTarget([&] { EXPECT_EQ(FragmentsOf(scene, *scene.Draw()), expected); });
    }
  }
  Shape mesh = RandomMesh(random, 1000, 10);
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kPerspective), {200, 150})};
  scene.Add(mesh);
  const auto expected = FragmentsOf(scene, *scene.Draw());
  std::ranges::reverse(mesh.triangles);
  Scene other = {scene.setup};
  other.setup.shapes.clear();
  other.Add(mesh);
  EXPECT_EQ(FragmentsOf(other, *other.Draw()), expected);
}

TEST(FrameShapes, DoesNotDependOnTheOrderOfShapes) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kPerspective), {100, 100})};
  const Shape a = RandomMesh(random, 200, 15), b = SphereMesh({50, 50, 50}, 30, 100);
  Scene other = scene;
  scene.Add(a, {.opacity = 0.5});
  scene.Add(b, {.color = {1, 0, 0}});
  other.Add(b, {.color = {1, 0, 0}});
  other.Add(a, {.opacity = 0.5});
  EXPECT_EQ(FragmentsOf(scene, *scene.Draw()), FragmentsOf(other, *other.Draw()));
}

// A floor below the eye and behind it.
TEST(FrameShapes, TrianglesMayPassTheEye) {
  ViewParameters view = View(Projection::kPerspective, 20, 5);
  view.fov_degrees = 60;
  Scene scene = {EmptyFrame({{50, 50, 50}}, view, {160, 120})};
  const Vec3 floor = {25, 25, 10};
  scene.Add(Plane(floor, {3000, 0, 0}, {0, 3000, 0}, 3));
  const auto shapes = scene.Draw();
  int seen = 0;
  ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
    const auto [origin, direction] = RayOf(scene.setup, x + 0.5, y + 0.5);
    const double depth = (floor.z - origin.z) / direction.z;
    const Vec3 hit = origin + depth * direction - floor;
    const bool on_floor = depth > 0 && std::max(std::abs(hit.x), std::abs(hit.y)) < 1450;
    if (on_floor && depth < 500) {
      ASSERT_FALSE(fragments.empty()) << x << ", " << y;
      EXPECT_EQ(fragments.back().rgba[3], 1);
      if (fragments.size() > 1) return;  // it is seen almost from its edge
      EXPECT_NEAR(fragments[0].depth, depth, 1e-4 * depth) << x << ", " << y;
      ++seen;
    } else if (depth < 0 && (origin + 2000 * direction).z > floor.z + 100) {
      EXPECT_TRUE(fragments.empty()) << x << ", " << y;
    }
  });
  EXPECT_GT(seen, 2000);
}

void ExpectSound(const Scene& scene) {
  const auto shapes = scene.Draw();
  ForEachPixel(scene.setup, *shapes, [&](int x, int y, std::span<const ShapeFragment> fragments) {
    float last = -std::numeric_limits<float>::infinity();
    ASSERT_LE(fragments.size(), kMostShapeFragments);
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      const auto& [depth, rgba] = fragments[i];
      ASSERT_TRUE(std::isfinite(depth)) << x << ", " << y;
      ASSERT_GE(depth, last);
      last = depth;
      ASSERT_GT(rgba[3], 0);
      ASSERT_LE(rgba[3], 1);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_TRUE(rgba[c] >= 0 && rgba[c] <= rgba[3]) << rgba[c];
      ASSERT_TRUE(rgba[3] < 1 || i + 1 == fragments.size());
    }
    const ShapeTile& tile = shapes->TileAt(x, y);
    if (tile.empty()) return;
    const bool ends = !fragments.empty() && fragments.back().rgba[3] == 1;
    ASSERT_EQ(tile.ends[tile.Number(x, y)], ends ? fragments.back().depth : kRayGoesOn);
    const PixelBounds bounds = shapes->bounds();
    ASSERT_TRUE(fragments.empty() || bounds.Contains({x, y, x + 1, y + 1}));
  });
}

TEST(FrameShapes, FragmentsAreSoundWhateverTheShapes) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (const bool slices : {false, true}) {
    for (const Projection projection : kProjections) {
      ExpectSound(RandomScene(random, projection, slices));
      // Needles, and shapes from a millionth of the volume to a million of it.
      for (const double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
        for (const double opacity : {1.0, 0.5}) {
          Scene scene = {EmptyFrame({{100, 100, 100}}, View(projection), {100, 80}, slices)};
          Shape mesh = RandomMesh(random, 100, scale);
          for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 6) {
            for (std::size_t c = 0; c < 3; ++c) {
              mesh.positions[i + 2][c] = 0.5F * (mesh.positions[i][c] + mesh.positions[i + 1][c]) + float(c) * 1e-5F;
            }
          }
          scene.Add(mesh, {.opacity = opacity});
          mesh.kind = ShapeKind::kPoints;
          mesh.triangles = {};
          scene.Add(mesh, {.opacity = opacity, .width = scale});
          ExpectSound(scene);
        }
      }
    }
  }
}

TEST(FrameShapes, ManyTranslucentLayersAreBoundedAndTakeAllTheLight) {
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kOrthographic, 0, 0), {20, 20})};
  for (int i = 0; i < 50; ++i) scene.Add(Plane({50, 10.0 + i, 50}, {300, 0, 0}, {0, 0, 300}, 1), {.opacity = 0.02});
  for (int i = 0; i < 14; ++i) scene.Add(Plane({50, 70.0 + i, 50}, {300, 0, 0}, {0, 0, 300}, 1), {.opacity = 0.02});
  ExpectSound(scene);
  const auto shapes = scene.Draw();
  EXPECT_NEAR(Coverage(scene.setup, *shapes), 400 * (1 - std::pow(0.98, 64)), 1e-2);
  EXPECT_EQ(shapes->TileAt(3, 3).At(3, 3).size(), 64U);
  Shape many = Plane({50, 90, 50}, {300, 0, 0}, {0, 0, 300}, 1);
  const std::size_t vertices = many.positions.size();
  for (std::uint32_t i = 1; i < 20; ++i) {
    for (std::size_t v = 0; v < vertices; ++v) many.positions.push_back({many.positions[v][0], float(i), many.positions[v][2]});
    for (std::size_t t = 0; t < 2; ++t) {
      const auto& [a, b, c] = many.triangles[t];
      many.triangles.push_back({a + i * std::uint32_t(vertices), b + i * std::uint32_t(vertices), c + i * std::uint32_t(vertices)});
    }
  }
  scene.setup.shapes.pop_back();
  scene.bytes.pop_back();
  scene.Add(many, {.opacity = 0.02});
  const auto more = scene.Draw();
  EXPECT_NEAR(Coverage(scene.setup, *more), 400 * (1 - std::pow(0.98, 63 + 20)), 1e-2);
  EXPECT_EQ(more->TileAt(3, 3).At(3, 3).size(), 64U);
}

// Sheets of one shape, so many that the farthest ones are left out.
TEST(FrameShapes, PixelsSeeTheNearestHits) {
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kOrthographic, 0, 0), {20, 20})};
  Shape sheets;
  for (std::uint32_t i = 0; i < 700; ++i) {
    for (const auto& [x, z] : {std::pair(-200, -200), std::pair(400, -200), std::pair(-200, 400)}) {
      sheets.positions.push_back({float(x), -300.0F + 3 * float(i), float(z)});
      sheets.colors.push_back({std::uint8_t(i < kMostShapeHits ? 255 : 0), 0, 0, 3});
    }
    sheets.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  scene.setup.shading.model = ShadingModel::kNone;
  scene.Add(sheets, {.coloring = ShapeColoring::kVertices});
  const auto shapes = scene.Draw();
  const auto seen = Composited(shapes->TileAt(5, 5).At(5, 5));
  EXPECT_NEAR(seen[3], 1 - std::pow(1 - 3 / 255.0, kMostShapeHits), 1e-3);
  EXPECT_NEAR(seen[0], seen[3], 1e-3) << "the others are not seen";
}

TEST(FrameShapes, DamagedBytesAreDataLoss) {
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kOrthographic), {20, 20})};
  scene.Add(Point({50, 50, 50}, 3));
  auto damaged = std::make_shared<VoxelBlock>(*scene.bytes[0]);
  damaged->bytes.pop_back();
  scene.bytes[0] = damaged;
  EXPECT_EQ(MakeFrameShapes(scene.setup, scene.bytes, nullptr).status().code(), StatusCode::kDataLoss);
}

// Any positions and bounds may stand in bytes that are not refused.
TEST(FrameShapes, AnyNumbersAreDrawnWithoutACrash) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  Scene scene = {EmptyFrame({{100, 100, 100}}, View(Projection::kPerspective), {80, 80})};
  scene.Add(SphereMesh({50, 50, 50}, 30, 20));
  const auto good = scene.bytes[0];
  for (int i = 0; i < 300; ++i) {
    auto damaged = std::make_shared<VoxelBlock>(*good);
    for (int n = 0; n < 20; ++n)
      damaged->bytes[random.Integer<std::size_t>(192, damaged->bytes.size() - 1)] = std::byte(random.Integer(0, 255));
    scene.bytes[0] = damaged;
    const auto shapes = MakeFrameShapes(scene.setup, scene.bytes, nullptr);
    if (shapes.ok()) (void)FragmentsOf(scene, **shapes);
  }
}

}  // namespace
}  // namespace slabstream
