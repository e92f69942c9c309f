#include "common/mesh/point_gradients.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/mesh/mesh_samples.h"

namespace slabstream {
namespace {

Vec3 At(const AlignedVector<Vector3<float>>& gradients, std::size_t point) {
  const Vector3<float>& g = gradients[point];
  return {double(g.x), double(g.y), double(g.z)};
}

TEST(PointGradients, OfALinearFieldAreItsGradientEverywhere) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (const double size : {1.0, 1e-30, 1e30}) {
    const Vec3 gradient = {3, -2, 0.5};
    const Mesh mesh = MakeTetrahedralCube({20, 30, 10}, 6, random, 0.2, [&](const Vec3& p) { return size * Dot(gradient, p); });
    const AlignedVector<Vector3<float>> gradients = PointGradients(mesh);
    ASSERT_EQ(gradients.size(), mesh.points.size());
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      EXPECT_LT(Length(At(gradients, i) - Normalized(gradient)), 1e-4) << i;
    }
  }
}

// Two cells on one face: the gradient along x is 1 in the small one, and 4 in the one that is twice as large.
TEST(PointGradients, AreMeansByVolume) {
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {-2, 0, 0}};
  mesh.tetrahedra = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  mesh.values = {0, 0, 0, 1, -8};
  const auto expect = [&](const std::vector<Vec3>& expected) {
    const AlignedVector<Vector3<float>> gradients = PointGradients(mesh);
    double longest = 0;
    for (const Vec3& g : expected) longest = std::max(longest, Length(g));
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_LT(Length(At(gradients, i) - 1 / longest * expected[i]), 1e-6) << i << ": " << gradients[i].x << ' ' << gradients[i].y;
    }
  };
  const Vec3 small = {1, 0, 0}, large = {4, 0, 0}, mean = {3, 0, 0};
  expect({mean, mean, mean, small, large});
  // Inside out, which changes nothing.
  mesh.tetrahedra[0] = {1, 0, 2, 3};
  expect({mean, mean, mean, small, large});
  // A value that is not finite hides its cell.
  mesh.values[3] = std::numeric_limits<float>::quiet_NaN();
  expect({large, large, large, {}, large});
  // Values of cells: 2 at the common points, 3 and 1.5 at the others.
  mesh.at = ValuesAt::kCells;
  mesh.values = {3, 1.5F};
  expect({{0.5, 0, 0}, {0.5, 0, 0}, {0.5, 0, 0}, {1, 0, 0}, {0.25, 0, 0}});
}

TEST(PointGradients, AreFiniteForAnyMesh) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  Mesh mesh = MakeTetrahedralCube({20, 20, 20}, 4, random, 0.2, [&](const Vec3&) { return random.Real(-3e38, 3e38); });
  for (const bool flat : {false, true}) {
    for (Vector3<float>& p : mesh.points) p.z = flat ? 3 : p.z;
    for (const Vector3<float>& g : PointGradients(mesh)) EXPECT_TRUE(std::isfinite(g.x) && std::isfinite(g.y) && std::isfinite(g.z));
  }
  EXPECT_TRUE(PointGradients(Mesh()).empty());
}

}  // namespace
}  // namespace slabstream
