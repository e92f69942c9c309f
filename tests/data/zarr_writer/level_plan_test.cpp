#include "data/zarr_writer/level_plan.h"

#include <gtest/gtest.h>

namespace slabstream {
namespace {

std::vector<Index3> SizesOf(const std::vector<WrittenLevel>& levels) {
  std::vector<Index3> sizes;
  for (const WrittenLevel& level : levels) sizes.push_back(level.size);
  return sizes;
}

TEST(LevelPlanTest, AVolumeThatFitsAChunkHasOneLevel) {
  EXPECT_EQ(SizesOf(PlanLevels({.size = {64, 1, 3}}, 64)), (std::vector<Index3>{{64, 1, 3}}));
}

TEST(LevelPlanTest, CubesAreHalvedAlongAllAxes) {
  EXPECT_EQ(SizesOf(PlanLevels({.size = {500, 130, 20}}, 64)),
            (std::vector<Index3>{{500, 130, 20}, {250, 65, 10}, {125, 33, 5}, {63, 17, 3}}));
}

TEST(LevelPlanTest, VoxelsBecomeCubesFirst) {
  EXPECT_EQ(SizesOf(PlanLevels({.size = {512, 512, 300}, .spacing = {1, 1, 5}}, 64)),
            (std::vector<Index3>{{512, 512, 300}, {256, 256, 300}, {128, 128, 300}, {64, 64, 150}, {32, 32, 75}, {16, 16, 38}}));
}

TEST(LevelPlanTest, ALongAxisOfLargeSpacingIsHalvedToo) {
  EXPECT_EQ(SizesOf(PlanLevels({.size = {32, 32, 200}, .spacing = {1, 1, 5}}, 64)),
            (std::vector<Index3>{{32, 32, 200}, {16, 16, 100}, {8, 8, 50}}));
}

TEST(LevelPlanTest, CentresAreThoseOfTheVoxelsThatAreInOne) {
  const std::vector<WrittenLevel> levels = PlanLevels({.size = {256, 256, 40}, .spacing = {0.5, 0.5, 2}}, 64);
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_EQ(levels[2].spacing, (Vec3{2, 2, 2}));
  EXPECT_EQ(levels[2].first, (Vec3{0.75, 0.75, 0}));  // (4 - 1) / 2 * 0.5
  EXPECT_EQ(levels[1].step, (Index3{2, 2, 1}));
}

}  // namespace
}  // namespace slabstream
