#include "laboratory/bench/ball_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

#include "common/mesh/mesh.h"

namespace slabstream {
namespace {

TEST(BallGrid, IsACubeOfTetrahedraWithABall) {
  for (const auto& [size, cells] : {std::pair{20, 4}, {33, 7}}) {
    const Volume grid = MakeBallGrid({.size = size, .cells = cells}).value();
    EXPECT_EQ(grid.description.geometry.size, (Index3{size, size, size}));
    ASSERT_NE(grid.cells, nullptr);
    EXPECT_EQ(grid.cells->points.size(), std::size_t(std::pow(cells + 1, 3)));
    EXPECT_GE(grid.cells->tetrahedra.size(), std::size_t(5 * cells * cells * cells));
    double volume = 0;  // the tetrahedra fill the cube and do not overlap
    for (const Tetrahedron& tetrahedron : grid.cells->tetrahedra) {
      std::array<Vec3, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) {
        const Vector3<float>& point = grid.cells->points[tetrahedron[i]];
        corners[i] = {double(point.x), double(point.y), double(point.z)};
      }
      volume += std::abs(Dot(corners[1] - corners[0], Cross(corners[2] - corners[0], corners[3] - corners[0]))) / 6;
    }
    EXPECT_NEAR(volume, std::pow(size, 3), 1e-3 * std::pow(size, 3));
    const auto* samples = grid.block.samples<float>();
    const auto at = [&, size = size](int x) { return samples[(std::int64_t{size / 2} * size + size / 2) * size + x]; };
    EXPECT_LT(at(0), 30);  // a point at the side has 0, its neighbour inside has more
    EXPECT_GT(at(size / 2), 150);
  }
}

TEST(BallGrid, RefusesWhatCannotBeMade) {
  EXPECT_THAT(MakeBallGrid({.size = 7}).status().message(), testing::HasSubstr("size of a grid is 7, must be in [8, 1024]"));
  EXPECT_THAT(MakeBallGrid({.cells = 1}).status().message(), testing::HasSubstr("cells of a grid is 1, must be in [2, 256]"));
}

}  // namespace
}  // namespace slabstream
