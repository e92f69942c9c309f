#include "common/volume/filled_box.h"

#include <gtest/gtest.h>

#include "common/volume/box_assembly.h"
#include "common/volume/volume.h"
#include "tests/support/random_box.h"

namespace slabstream {
namespace {

TEST(FilledBoxTest, WithoutLeavesTheRest) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  const Box bounds = {{0, 0, 0}, {12, 11, 10}};
  for (int turn = 0; turn < 100; ++turn) {
    std::vector<FilledBox> filled;
    for (int i = random.Integer(0, 4); i > 0; --i) filled.push_back({RandomBox(random, bounds), 0});
    const Box box = RandomBox(random, bounds);
    const std::vector<Box> rest = Without({box}, filled);
    for (Index3 v; v.z < bounds.end.z; ++v.z) {
      for (v.y = 0; v.y < bounds.end.y; ++v.y) {
        for (v.x = 0; v.x < bounds.end.x; ++v.x) {
          const auto among = std::ranges::count_if(rest, [&](const Box& part) { return part.Contains(v); });
          const bool is_filled = std::ranges::any_of(filled, [&](const FilledBox& each) { return each.box.Contains(v); });
          ASSERT_EQ(among, box.Contains(v) && !is_filled ? 1 : 0);
        }
      }
    }
  }
}

TEST(FilledBoxTest, FillsNoMoreThanWhatMayBeFilled) {
  const FilledBox a = {{{0, 0, 0}, {8, 8, 8}}, 1}, b = {{{8, 0, 0}, {16, 8, 8}}, 2};
  const Box all = {{0, 0, 0}, {16, 8, 8}};
  EXPECT_TRUE(FillsNoMoreThan({}, all, {}));
  EXPECT_TRUE(FillsNoMoreThan({}, all, std::vector{a}));
  EXPECT_TRUE(FillsNoMoreThan(std::vector{a}, all, std::vector{b, a}));
  EXPECT_FALSE(FillsNoMoreThan(std::vector{a, b}, all, std::vector{b}));
  EXPECT_TRUE(FillsNoMoreThan(std::vector{a, b}, {{8, 0, 0}, {12, 8, 8}}, std::vector{b})) << "elsewhere it does not matter";
  EXPECT_FALSE(FillsNoMoreThan(std::vector{a}, all, std::vector{FilledBox{{{0, 0, 0}, {8, 8, 7}}, 1}}));
}

TEST(FilledBoxTest, BlocksTogetherAreThickAndNoLargerThanAllowed) {
  constexpr std::size_t kMost = 1 << 20;
  const Index3 volume = {1600, 1600, 1680};
  EXPECT_EQ(BlocksTogether({64, 64, 64}, volume, 2, kMost), (Index3{128, 64, 64}));
  EXPECT_EQ(BlocksTogether({1600, 1, 1}, volume, 2, kMost), (Index3{1600, 16, 16})) << "rows";
  EXPECT_EQ(BlocksTogether({256, 256, 256}, volume, 2, kMost), (Index3{256, 256, 256})) << "one alone is larger";
  EXPECT_EQ(BlocksTogether({4, 4, 4}, {10, 10, 1}, 2, kMost), (Index3{16, 16, 4})) << "no larger than the volume needs";
}

}  // namespace
}  // namespace slabstream
