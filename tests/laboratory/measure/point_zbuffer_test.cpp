#include "laboratory/measure/point_zbuffer.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace slabstream {
namespace {

// The plane x = z, seen along z: one voxel for each (x, y), and cells that cover magnified x magnified pixels each.
PointZBuffer::Holes HolesOfPlane(int n, int magnified) {
  std::vector<std::uint8_t> voxels(std::size_t(n * n * n));
  for (int y = 0; y < n; ++y) {
    for (int i = 0; i < n; ++i) voxels[std::size_t((i * n + y) * n + i)] = 1;
  }
  const float m = float(magnified), centre = 0.5F * m;
  const TransformMatrix matrix = {{{m, 0, 0, centre}, {0, m, 0, centre}, {0, 0, 1, 1}}};
  const int side = n * magnified;
  PointZBuffer points({side, side});
  points.Draw(matrix, {n, n, n}, voxels.data());
  std::vector<float> faces(std::size_t(side * side));  // of the front of the cells
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) faces[std::size_t(row * side + column)] = float(column / magnified) + 0.5F;
  }
  return points.HolesIn(faces);
}

TEST(PointZBuffer, APlaneAt45DegreesHasItsHoles) {
  for (const int n : {1, 2, 5, 8, 33, 64}) {
    const auto voxels = std::size_t(n * n);
    EXPECT_EQ(HolesOfPlane(n, 1).empty, 0U) << n;
    EXPECT_EQ(HolesOfPlane(n, 2).covered, 4 * voxels) << n;
    EXPECT_EQ(HolesOfPlane(n, 2).empty, 3 * voxels) << n;
    EXPECT_EQ(HolesOfPlane(n, 3).empty, 8 * voxels) << n;
    EXPECT_EQ(HolesOfPlane(n, 3).behind, 0U) << n;
  }
}

// A wall at z = 0 and another one at z = 5, magnified twice and seen askew: the second one is 5 columns to the right and shows in the
// first one's holes.
TEST(PointZBuffer, HolesShowWhatLiesBehind) {
  constexpr int kBack = 5;
  for (const int n : {6, 7, 20, 41}) {
    std::vector<std::uint8_t> voxels(std::size_t(n * n * (kBack + 1)));
    std::fill_n(voxels.begin(), n * n, std::uint8_t{1});
    std::fill_n(voxels.end() - n * n, n * n, std::uint8_t{1});
    PointZBuffer points({2 * n, 2 * n});
    points.Draw({{{2, 0, 1, 1}, {0, 2, 0, 1}, {0, 0, 1, 1}}}, {n, n, kBack + 1}, voxels.data());
    const PointZBuffer::Holes holes = points.HolesIn(std::vector<float>(std::size_t(4 * n * n), 0.5F));
    EXPECT_EQ(holes.behind, std::size_t(n * (n - 3))) << n;  // columns 6, 8, ...
    EXPECT_EQ(holes.empty, std::size_t(4 * n * n - n * n - n * (n - 3))) << n;
  }
}

// A wall seen straight on at half a pixel a voxel: four voxels fall on each pixel. A wall behind it is hidden, and doubles nothing.
TEST(PointZBuffer, VoxelsThatFallTogetherAreDoubledUnlessOneHidesTheOther) {
  for (const int n : {2, 6, 20}) {
    std::vector<std::uint8_t> voxels(std::size_t(n * n * 2), 1);
    const auto doubled = [&](float scale, int slices, float apart) {
      const TransformMatrix matrix = {{{scale, 0, 0, scale / 2}, {0, scale, 0, scale / 2}, {0, 0, apart, 1}}};
      PointZBuffer points({2 * n, 2 * n});
      points.Draw(matrix, {n, n, slices}, voxels.data());
      return points.CountDoubled(matrix, {n, n, slices}, voxels.data());
    };
    EXPECT_EQ(doubled(0.5F, 1, 1), std::size_t(n * n / 4)) << n;
    EXPECT_EQ(doubled(1, 1, 1), 0U) << n;
    EXPECT_EQ(doubled(2, 1, 1), 0U) << n;
    EXPECT_EQ(doubled(1, 2, 5), 0U) << n;
    EXPECT_EQ(doubled(1, 2, 0.5F), std::size_t(n * n)) << n;
  }
}

TEST(PointZBuffer, LeavesOutWhatFallsBesideTheImage) {
  const std::vector<std::uint8_t> voxels(3, 1);
  PointZBuffer points({2, 1});
  points.Draw({{{1, 0, 0, -0.5F}, {0, 1, 0, 0.5F}, {0, 0, 1, 1}}}, {3, 1, 1}, voxels.data());  // columns -0.5, 0.5, 1.5
  EXPECT_TRUE(points.Written(0));
  EXPECT_TRUE(points.Written(1));
  points.Draw({{{1, 0, 0, 1.5F}, {0, 1, 0, 0.5F}, {0, 0, 1, 1}}}, {3, 1, 1}, voxels.data());  // columns 1.5, 2.5, 3.5
  EXPECT_FALSE(points.Written(0)) << "each drawing begins with an empty image";
  EXPECT_TRUE(points.Written(1));
}

TEST(MatrixOf, IsTheCamera) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    ViewParameters view;
    view.azimuth_degrees = random.Real(-180, 180);
    view.elevation_degrees = random.Real(-80, 80);
    view.zoom = random.Real(0.5, 4);
    const Camera camera = MakeCamera(view, {200, 150}, {{100, 90, 80}, {1, 1, 1.5}});
    const TransformMatrix matrix = MatrixOf(camera);
    const Vec3 point = {random.Real(0, 100), random.Real(0, 90), random.Real(0, 80)};
    const Camera::ImagePoint projected = camera.Project(point);
    const auto at = [&](std::size_t c) { return matrix[c][0] * point.x + matrix[c][1] * point.y + matrix[c][2] * point.z + matrix[c][3]; };
    EXPECT_NEAR(at(0), projected.x, 1e-3);
    EXPECT_NEAR(at(1), projected.y, 1e-3);
    EXPECT_NEAR(at(2), projected.depth, 1e-3);
  }
}

}  // namespace
}  // namespace slabstream
