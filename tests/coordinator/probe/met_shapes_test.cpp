// Where rays meet shapes, against closed forms and brute force.
#include "coordinator/probe/met_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/coordinator/probe/picked_scene.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

struct WorldRay {
  Vec3 origin, direction;
  Vec3 At(double depth) const { return origin + depth * direction; }
};
WorldRay InWorld(const Scene& scene, const Camera::Ray& ray) {
  const VolumeGeometry& geometry = scene.setup.description.geometry;
  const Vec3 origin = geometry.ToWorld(ray.origin);
  return {origin, geometry.ToWorld(ray.origin + ray.direction) - origin};
}

Camera::Ray RandomRay(const Scene& scene, Random& random) {
  return scene.setup.camera.RayAt(random.Real(0, scene.setup.camera.width), random.Real(0, scene.setup.camera.height));
}

Scene RandomScene(Random& random) { return {EmptyFrame(Turned(), RandomView(random), {90, 70})}; }

// A shape without structure, so large and so far away that coordinates lose digits if they are not taken from a point near it.
Shape RandomMesh(Random& random, std::uint32_t triangles) {
  Shape shape;
  shape.origin = {100, -50, 7};
  for (std::uint32_t i = 0; i < 3 * triangles; ++i) {
    shape.positions.push_back({float(random.Real(-40, 90)), float(random.Real(-40, 90)), float(random.Real(-40, 90))});
    shape.values.push_back(float(random.Real(-5, 5)));
  }
  for (std::uint32_t i = 0; i < triangles; ++i) shape.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  return shape;
}

// T. Moeller, B. Trumbore: Fast, minimum storage ray-triangle intersection, 1997. `margin`: the least
// barycentric coordinate of the place where the ray meets the triangle's plane, without its sign. Near 0, the ray passes near an edge.
struct Hit {
  double depth = kNone, value = 0, margin = 0;
};
Hit ByMoellerTrumbore(const WorldRay& ray, const Shape& shape, const std::array<std::uint32_t, 3>& triangle) {
  const auto at = [&](std::size_t i) {
    const auto& p = shape.positions[triangle[i]];
    return shape.origin + Vec3{double(p[0]), double(p[1]), double(p[2])};
  };
  const Vec3 a = at(0), e1 = at(1) - a, e2 = at(2) - a, p = Cross(ray.direction, e2), s = ray.origin - a, q = Cross(s, e1);
  const double per = 1 / Dot(e1, p), u = per * Dot(s, p), v = per * Dot(ray.direction, q), margin = std::min({u, v, 1 - u - v});
  const auto value = [&](std::size_t i) { return double(shape.values[triangle[i]]); };
  return {margin < 0 ? kNone : per * Dot(e2, q), (1 - u - v) * value(0) + u * value(1) + v * value(2), std::abs(margin)};
}

TEST(MeetShapes, AreAllTrianglesOfARandomMesh) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  int seen = 0;
  for (int i = 0; i < 24; ++i) {
    Scene scene = RandomScene(random);
    const Shape mesh = RandomMesh(random, random.Integer(1U, 1500U));
    scene.Add(mesh, {.opacity = 0.01});
    for (int k = 0; k < 40; ++k) {
      const Camera::Ray ray = RandomRay(scene, random);
      std::vector<Hit> expected;
      bool clear = true;  // of edges, and of the eye
      const double nearest = scene.setup.camera.projection == Projection::kPerspective ? 0 : -kNone;
      for (const auto& triangle : mesh.triangles) {
        const Hit hit = ByMoellerTrumbore(InWorld(scene, ray), mesh, triangle);
        clear = clear && hit.margin > 1e-9 && std::abs(hit.depth) > 1e-3;
        if (hit.depth < kNone && hit.depth > nearest) expected.push_back(hit);
      }
      if (!clear) continue;
      std::ranges::sort(expected, {}, &Hit::depth);
      const std::vector<MetShape> met = MeetShapes(scene.setup, ViewsOf(scene), ray);
      ASSERT_EQ(met.size(), expected.size());
      for (std::size_t n = 0; n < met.size(); ++n) {
        EXPECT_NEAR(met[n].depth, expected[n].depth, 1e-7);
        ASSERT_TRUE(met[n].value);
        EXPECT_NEAR(*met[n].value, expected[n].value, 1e-6);
        ++seen;
      }
    }
  }
  EXPECT_GT(seen, 1000);
}

// Rays through the vertices and edges of a plane of many triangles.
TEST(MeetShapes, BordersOfTrianglesAreMetOnce) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 40; ++i) {
    Scene scene = RandomScene(random);
    const Camera& camera = scene.setup.camera;
    const VolumeGeometry& geometry = scene.setup.description.geometry;
    const auto n = random.Integer(1U, 60U);
    const Vec3 across = random.Real(200, 500) * geometry.orientation.ToWorld(camera.right),
               upwards = random.Real(200, 500) * geometry.orientation.ToWorld(camera.up + random.Real(-0.5, 0.5) * camera.view_direction);
    const Shape plane = Plane(geometry.ToWorld(geometry.centre()), across, upwards, n);
    scene.Add(plane, {.opacity = 0.25});
    for (int k = 0; k < 100; ++k) {
      const auto& [a, b, c] = plane.triangles[random.Integer<std::size_t>(0, plane.triangles.size() - 1)];
      const auto vertex = [&](std::uint32_t v) {
        const auto& p = plane.positions[v];
        return scene.setup.shapes[0].to_data.To(plane.origin + Vec3{double(p[0]), double(p[1]), double(p[2])});
      };
      const double t = k % 3 == 0 ? 0 : k % 3 == 1 ? 0.5 : random.Real(0, 1);
      const Camera::ImagePoint at = camera.Project((1 - t) * vertex(a) + t * vertex(k % 2 == 0 ? b : c));
      if (at.x < 0 || at.x > camera.width || at.y < 0 || at.y > camera.height) continue;
      EXPECT_EQ(MeetShapes(scene.setup, ViewsOf(scene), camera.RayAt(at.x, at.y)).size(), 1U) << at.x << ", " << at.y;
    }
  }
}

double DistanceTo(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 e = b - a;
  const double square = Dot(e, e), s = square > 0 ? std::clamp(Dot(p - a, e) / square, 0.0, 1.0) : 0;
  return Length(p - a - s * e);
}

// Tubes and balls of one radius: the first point of a ray that is as near to them as that.
TEST(MeetShapes, TubesAndBallsAreMetAtTheirRadius) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  int hits = 0, misses = 0;
  for (int i = 0; i < 16; ++i) {
    Scene scene = RandomScene(random);
    Shape shape{.kind = i % 2 == 0 ? ShapeKind::kLines : ShapeKind::kPoints, .origin = {100, -50, 7}, .line_begins = {}};
    const int count = random.Integer(2, 120);
    for (int k = 0; k < count; ++k)
      shape.positions.push_back({float(random.Real(-30, 80)), float(random.Real(-30, 80)), float(random.Real(-30, 80))});
    const bool lines = shape.kind == ShapeKind::kLines;
    if (lines) shape.line_begins = {0, std::uint32_t(count)};
    const double radius = random.Real(0.5, 3);
    scene.Add(shape, {.width = 2 * radius});
    const auto distance = [&](const Vec3& p) {
      double least = kNone;
      const auto at = [&](std::size_t n) {
        const auto& v = shape.positions[n];
        return shape.origin + Vec3{double(v[0]), double(v[1]), double(v[2])};
      };
      for (std::size_t n = 0; n + (lines ? 1 : 0) < shape.positions.size(); ++n)
        least = std::min(least, DistanceTo(p, at(n), at(lines ? n + 1 : n)));
      return least;
    };
    for (int k = 0; k < 60; ++k) {
      const Camera::Ray ray = RandomRay(scene, random);
      const WorldRay in_world = InWorld(scene, ray);
      const std::vector<MetShape> met = MeetShapes(scene.setup, ViewsOf(scene), ray);
      const double end = met.empty() ? 600 : met[0].depth, begin = scene.setup.camera.projection == Projection::kPerspective ? 0 : -300;
      if (distance(in_world.At(begin)) < radius) continue;  // it holds the eye
      if (!met.empty()) {
        EXPECT_NEAR(distance(in_world.At(end)), radius, 1e-6);
      }
      for (int part = 0; part < 500; ++part)
        ASSERT_GT(distance(in_world.At(begin + (end - begin) * part / 500)), radius - 1e-6) << "of " << end << ", part " << part;
      ++(met.empty() ? misses : hits);
    }
  }
  EXPECT_GT(hits, 100);
  EXPECT_GT(misses, 100);
}

// A cone with round ends: its radius and value change along it.
TEST(MeetShapes, RadiiAndValuesChangeAlongALine) {
  Scene scene = {EmptyFrame({{40, 40, 40}}, {.azimuth_degrees = 0}, {80, 80})};
  scene.Add(Shape{
      .kind = ShapeKind::kLines, .positions = {{0, 20, 20}, {40, 20, 20}}, .values = {-2, 6}, .radii = {2, 6}, .line_begins = {0, 2}});
  const double slope = 0.1, cosine = std::sqrt(1 - slope * slope);
  for (const double x : {5.0, 20.0, 33.0}) {
    const Camera::ImagePoint at = scene.setup.camera.Project({x, 20, 20});
    const std::vector<MetShape> met = MeetShapes(scene.setup, ViewsOf(scene), scene.setup.camera.RayAt(at.x, at.y));
    ASSERT_EQ(met.size(), 1U);
    // The tangent of the balls with the radii 2 + slope x is (2 + slope x) / cosine from the axis; it touches the ball round x - slope r.
    const double reach = (2 + slope * x) / cosine;
    EXPECT_NEAR(met[0].depth, at.depth - reach, 1e-9) << x;
    const double s = (x + slope * (2 + slope * x) / (cosine * cosine)) / 40;
    EXPECT_NEAR(met[0].value.value_or(0), -2 + 8 * s, 1e-6) << x;
  }
}

TEST(MeetShapes, WidthsInPixelsAreThoseOfThePicture) {
  for (const Projection projection : {Projection::kOrthographic, Projection::kPerspective}) {
    Scene scene = {EmptyFrame(Turned(), {.projection = projection, .azimuth_degrees = 30, .elevation_degrees = 20}, {200, 160})};
    const VolumeGeometry& geometry = scene.setup.description.geometry;
    const Vec3 p = {20, 30, 12};
    for (const double width : {0.0, 3.0, 11.0}) {  // 0: the standard one of points
      scene.setup.shapes.clear();
      scene.bytes.clear();
      Shape point = Point(geometry.ToWorld(p), 1);
      point.radii.clear();
      scene.Add(point, {.width = width, .width_in_pixels = true});
      const Camera::ImagePoint at = scene.setup.camera.Project(p);
      const double radius = 0.5 * (width == 0 ? kStandardPointWidth : width);
      for (int turn = 0; turn < 8; ++turn) {
        const auto meets = [&](double share) {
          const double angle = turn * 0.7;
          const Camera::Ray ray =
              scene.setup.camera.RayAt(at.x + share * radius * std::cos(angle), at.y + share * radius * std::sin(angle));
          return !MeetShapes(scene.setup, ViewsOf(scene), ray).empty();
        };
        EXPECT_TRUE(meets(0.98)) << width;
        EXPECT_FALSE(meets(1.05)) << width;
      }
    }
  }
}

// The two pieces of a line overlap in their joint.
TEST(MeetShapes, JointsOfALineAreOneSurface) {
  Scene scene = {EmptyFrame({{40, 40, 40}}, {.azimuth_degrees = 0}, {80, 80})};
  const Shape line{.kind = ShapeKind::kLines, .positions = {{0, 20, 20}, {20, 20, 20}, {40, 20, 20}}, .line_begins = {0, 3}};
  scene.Add(line, {.opacity = 0.4, .width = 6});
  scene.Add(line, {.opacity = 0.4, .width = 4});
  const Camera::ImagePoint at = scene.setup.camera.Project({20, 20, 20.5});
  const std::vector<MetShape> met = MeetShapes(scene.setup, ViewsOf(scene), scene.setup.camera.RayAt(at.x, at.y));
  ASSERT_EQ(met.size(), 2U);
  EXPECT_EQ(met[0].shape, 0U);
  EXPECT_EQ(met[1].shape, 1U);
}

TEST(MeetShapes, ColoursOfVerticesTakeTheirShare) {
  Scene scene = {EmptyFrame({{40, 40, 40}}, {.azimuth_degrees = 0}, {80, 80})};
  Shape sheet{.positions = {{0, 20, 0}, {40, 20, 0}, {0, 20, 40}}, .triangles = {{0, 1, 2}}};
  sheet.colors = {{0, 0, 0, 255}, {0, 0, 0, 55}, {0, 0, 0, 155}};
  sheet.values = {1, 5, std::numeric_limits<float>::quiet_NaN()};
  scene.Add(sheet, {.coloring = ShapeColoring::kVertices, .opacity = 0.5});
  scene.Add(sheet);  // in one colour
  const auto met_at = [&](double x, double z) {
    const Camera::ImagePoint at = scene.setup.camera.Project({x, 20, z});
    return MeetShapes(scene.setup, ViewsOf(scene), scene.setup.camera.RayAt(at.x, at.y));
  };
  const std::vector<MetShape> met = met_at(10, 10);
  ASSERT_EQ(met.size(), 2U);
  EXPECT_NEAR(met[0].opacity, 0.5 * (0.5 * 255 + 0.25 * 55 + 0.25 * 155) / 255, 1e-9);
  EXPECT_FALSE(met[0].value) << "a vertex has none";
  EXPECT_EQ(met[1].opacity, 1);
  EXPECT_TRUE(met_at(41, 1).empty());
}

// Values by place, with a hole.
TEST(MeetShapes, PlanesHaveTheValuesOfTheirPlaces) {
  Scene scene = {EmptyFrame({{40, 40, 40}}, {.azimuth_degrees = 0}, {80, 80})};
  Shape plane = Plane({20, 20, 20}, {40, 0, 0}, {0, 0, 40}, 1);
  plane.plane = {.columns = 5, .rows = 9, .column = {0.1, 0, 0, 2}, .row = {0, 0, 0.2, 4}, .samples = std::vector<float>(45)};
  const auto of = [](double column, double row) { return 3 * column - 2 * row + 0.5 * column * row; };
  for (std::size_t i = 0; i < 45; ++i) plane.plane.samples[i] = float(of(double(i % 5), double(i / 5)));
  plane.plane.samples[8 * 5 + 4] = std::numeric_limits<float>::quiet_NaN();
  scene.Add(plane, {.coloring = ShapeColoring::kValues, .map = std::vector<Rgb>(kShapeMapColors)});
  const auto met_at = [&](double x, double z) {
    const Camera::ImagePoint at = scene.setup.camera.Project({x, 20, z});
    return MeetShapes(scene.setup, ViewsOf(scene), scene.setup.camera.RayAt(at.x, at.y));
  };
  for (const auto& [x, z] : {std::pair(3.0, 7.0), std::pair(17.2, 31.0), std::pair(33.0, 11.1)}) {
    const std::vector<MetShape> met = met_at(x, z);
    ASSERT_EQ(met.size(), 1U);
    EXPECT_NEAR(met[0].value.value_or(1e9), of(0.1 * x, 0.2 * z), 1e-4) << x << ", " << z;
  }
  EXPECT_TRUE(met_at(38, 39).empty());
}

}  // namespace
}  // namespace slabstream
