#include "common/shapes/packed_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "common/parallel/task_arena.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using ::testing::HasSubstr;

// A wavy sheet of n x n vertices.
Shape Sheet(std::uint32_t n) {
  Shape shape;
  shape.origin = {10, -20, 1e6};
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      shape.positions.push_back({float(x), float(y), 3 * std::sin(0.1F * float(x)) + std::cos(0.2F * float(y))});
    }
  }
  for (std::uint32_t y = 0; y + 1 < n; ++y) {
    for (std::uint32_t x = 0; x + 1 < n; ++x) {
      const std::uint32_t v = y * n + x;
      shape.triangles.push_back({v, v + 1, v + n});
      shape.triangles.push_back({v + 1, v + n + 1, v + n});
    }
  }
  return shape;
}

using Corner = std::array<float, 3>;
std::multiset<std::array<Corner, 3>> TrianglesOf(const ShapeView& view) {
  std::multiset<std::array<Corner, 3>> triangles;
  for (const ShapePiece& piece : view.pieces) {
    for (std::size_t part = piece.first_part; part < std::size_t{piece.first_part} + piece.parts; ++part) {
      std::array<Corner, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t v = piece.first_vertex + view.corners[3 * part + i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          corners[i][axis] = view.positions[axis][v];
          EXPECT_GE(corners[i][axis], piece.low[axis]);
          EXPECT_LE(corners[i][axis], piece.high[axis]);
        }
      }
      std::ranges::rotate(corners, std::ranges::min_element(corners));
      triangles.insert(corners);
    }
  }
  return triangles;
}

TEST(PackedShape, HasTheTrianglesOfTheShape) {
  const Shape shape = Sheet(50);
  const auto bytes = PackShape(shape).value();
  const ShapeView view = ViewShape(bytes).value();
  std::multiset<std::array<Corner, 3>> expected;
  for (const auto& triangle : shape.triangles) {
    std::array<Corner, 3> corners = {shape.positions[triangle[0]], shape.positions[triangle[1]], shape.positions[triangle[2]]};
    std::ranges::rotate(corners, std::ranges::min_element(corners));
    expected.insert(corners);
  }
  EXPECT_EQ(TrianglesOf(view), expected);
  EXPECT_EQ(view.origin, shape.origin);
  EXPECT_EQ(view.info.parts, shape.triangles.size());
  EXPECT_EQ(view.info.vertices, shape.positions.size());
  EXPECT_EQ(view.info.low.x, 10);
  EXPECT_EQ(view.info.high.y, -20 + 49);
}

TEST(PackedShape, IsCompact) {
  const Shape shape = Sheet(300);
  const auto bytes = PackShape(shape).value();
  EXPECT_LT(double(bytes.size()), 20 * double(shape.triangles.size()));
}

TEST(PackedShape, DoesNotDependOnTheOrderOfTrianglesOrOnThreads) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  const Shape shape = Sheet(40);
  Shape other = shape;
  for (auto& triangle : other.triangles) std::ranges::rotate(triangle, triangle.begin() + random.Integer(0, 2));
  for (std::size_t i = other.triangles.size() - 1; i > 0; --i) {
    std::swap(other.triangles[i], other.triangles[random.Integer<std::size_t>(0, i)]);
  }
  const auto expected = PackShape(shape).value();
  for (const int threads : {1, 2, 8}) {
    TaskArena arena(threads);
    EXPECT_EQ(arena.Run([&] { return PackShape(other).value(); }), expected);
  }
}

TEST(PackedShape, NormalsComeFromTheTrianglesWhereTheShapeHasNone) {
  Shape shape;
  shape.positions = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 7}};
  shape.triangles = {{0, 1, 2}};
  const auto flat = PackShape(shape).value();
  const ShapeView flat_view = ViewShape(flat).value();
  for (const std::uint32_t normal : flat_view.normals) EXPECT_EQ(ShapeNormalOf(normal), (Vec3{0, 0, 1}));
  shape.normals = {{0, 0, -1}, {1, 0, 0}, {0, 0, 0}, {0, 1, 0}};
  const auto given = PackShape(shape).value();
  const ShapeView view = ViewShape(given).value();
  std::map<float, Vec3> normal_at;
  for (std::size_t i = 0; i < 3; ++i) normal_at[view.positions[0][i] + 2 * view.positions[1][i]] = ShapeNormalOf(view.normals[i]);
  EXPECT_EQ(normal_at[0], (Vec3{0, 0, -1}));
  EXPECT_EQ(normal_at[2], (Vec3{1, 0, 0}));
  EXPECT_EQ(normal_at[4], (Vec3{}));
}

TEST(PackedShape, NormalsAreExactToATenThousandth) {
  Random random(2);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 normal = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)};
    EXPECT_LT(Length(ShapeNormalOf(PackShapeNormal(normal)) - Normalized(normal)), 7e-5);
  }
}

TEST(PackedShape, KeepsWhatVerticesHave) {
  Shape shape;
  shape.kind = ShapeKind::kLines;
  shape.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}, {6, 5, 5}};
  shape.line_begins = {0, 3, 5};
  shape.radii = {0, 1, 2, 3, 4};
  shape.values = {0, 10, std::numeric_limits<float>::quiet_NaN(), -30, 40};
  shape.colors = {{0, 0, 0, 255}, {1, 0, 0, 255}, {2, 0, 0, 255}, {3, 0, 0, 9}, {4, 0, 0, 255}};
  const auto bytes = PackShape(shape).value();
  const ShapeView view = ViewShape(bytes).value();
  EXPECT_EQ(view.info.parts, 3U);
  EXPECT_EQ(view.info.least, -30);
  EXPECT_EQ(view.info.largest, 40);
  EXPECT_EQ(view.info.low, (Vec3{0, -2, -2})) << "of the ball round (2, 0, 0), and that round (1, 0, 0)";
  EXPECT_EQ(view.info.high, (Vec3{10, 9, 9}));
  EXPECT_TRUE(view.see_through);
  ASSERT_EQ(view.positions[0].size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto at = std::ranges::find(shape.positions, Corner{view.positions[0][i], view.positions[1][i], view.positions[2][i]});
    const auto v = std::size_t(at - shape.positions.begin());
    EXPECT_EQ(view.radii[i], shape.radii[v]);
    EXPECT_EQ(view.colors[i], shape.colors[v]);
    if (v != 2) {
      EXPECT_EQ(view.values[i], shape.values[v]);
    }
  }
}

TEST(PackedShape, LeavesOutTrianglesWithoutAnArea) {
  Shape shape;
  shape.positions = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 1, 0}};
  shape.triangles = {{0, 1, 2}, {0, 1, 1}, {0, 1, 3}};
  const auto bytes = PackShape(shape).value();
  EXPECT_EQ(ViewShape(bytes).value().info.parts, 1U);
  shape.triangles.resize(2);
  const auto none = PackShape(shape).value();
  EXPECT_TRUE(ViewShape(none).value().pieces.empty());
}

TEST(PackedShape, BadShapesSayWhatIsWrong) {
  const Shape good = Sheet(3);
  const auto message = [&](auto&& spoil) {
    Shape shape = good;
    spoil(shape);
    const auto packed = PackShape(shape);
    EXPECT_EQ(packed.status().code(), StatusCode::kInvalidArgument);
    return packed.status().message();
  };
  EXPECT_THAT(message([](Shape& s) { s.triangles[3][1] = 9; }), HasSubstr("shape.triangles[3] has vertex 9, must be below 9"));
  EXPECT_THAT(message([](Shape& s) { s.positions[4][2] = std::numeric_limits<float>::infinity(); }), HasSubstr("shape.positions[4]"));
  EXPECT_THAT(message([](Shape& s) { s.values.resize(5); }), HasSubstr("shape.values has 5 elements, must have 0 or 9"));
  EXPECT_THAT(message([](Shape& s) { s.radii.assign(9, -1); }), HasSubstr("shape.radii[0] is -1"));
  EXPECT_THAT(message([](Shape& s) { s.origin.y = HUGE_VAL; }), HasSubstr("shape.origin"));
  EXPECT_THAT(message([](Shape& s) {
                s.kind = ShapeKind::kLines;
                s.triangles.clear();
                s.line_begins = {0, 1};
              }),
              HasSubstr("shape.line_begins[0]"));
}

TEST(PackedShape, DamagedBytesAreRefusedOrReadWithinTheirBounds) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  const auto bytes = PackShape(Sheet(20)).value();
  EXPECT_EQ(ViewShape(std::span(bytes).first(bytes.size() - 1)).status().code(), StatusCode::kDataLoss);
  EXPECT_EQ(ViewShape(std::span(bytes).first(7)).status().code(), StatusCode::kDataLoss);
  for (int i = 0; i < 3000; ++i) {
    auto damaged = bytes;
    damaged[random.Integer<std::size_t>(0, i % 2 == 0 ? 400 : bytes.size() - 1)] = std::byte(random.Integer(0, 255));
    const auto view = ViewShape(damaged);
    if (!view.ok()) {
      EXPECT_EQ(view.status().code(), StatusCode::kDataLoss);
      continue;
    }
    for (const ShapePiece& piece : view->pieces) {
      for (std::size_t c = 0; c < std::size_t{3} * piece.parts; ++c) {
        EXPECT_LT(piece.first_vertex + view->corners[std::size_t{3} * piece.first_part + c], view->positions[2].size());
      }
    }
  }
}

TEST(PackedShape, KeepsTheValuesOfAPlane) {
  Shape shape = Sheet(2);
  shape.plane = {.columns = 3, .rows = 2, .column = {1, 2, 3, 4}, .row = {5, 6, 7, 8}, .samples = {0, 1, 2, 3, -4, 5}};
  const AlignedVector<std::byte> bytes = PackShape(shape).value();
  const ShapeView view = ViewShape(bytes).value();
  EXPECT_EQ(std::tuple(view.plane.columns, view.plane.rows), std::tuple(3, 2));
  EXPECT_EQ(view.plane.column, shape.plane.column);
  EXPECT_EQ(view.plane.row, shape.plane.row);
  EXPECT_TRUE(std::ranges::equal(view.plane.samples, shape.plane.samples));
  EXPECT_EQ(std::tuple(view.info.has_values, view.info.least, view.info.largest, view.see_through), std::tuple(true, -4, 5, false));
  shape.plane.samples[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(ViewShape(PackShape(shape).value())->see_through);
  shape.plane.samples.pop_back();
  EXPECT_THAT(PackShape(shape).status().message(), HasSubstr("shape.plane has 5 samples, must have 3 x 2"));
  shape.plane = {.columns = kMaxPlaneSide + 1, .rows = 1, .samples = std::vector<float>(kMaxPlaneSide + 1)};
  EXPECT_THAT(PackShape(shape).status().message(), HasSubstr("at most 4096 a side"));
  shape.plane = {.columns = 1, .rows = 1, .samples = {1}};
  shape.values = {1, 2, 3, 4};
  EXPECT_THAT(PackShape(shape).status().message(), HasSubstr("without values of vertices"));
}

}  // namespace
}  // namespace slabstream
