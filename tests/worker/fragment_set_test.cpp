#include "worker/fragment_set.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

TEST(FragmentSet, CutsAndJoinsFragments) {
  FragmentSet set;
  set.Insert({{0, 10}, {2, 3}, 7});
  EXPECT_EQ(set.Take({4, 6}), (std::vector<Fragment>{{{4, 6}, {2, 3}, 7}}));
  EXPECT_EQ(set.fragments(), (std::vector<Fragment>{{{0, 4}, {2, 3}, 7}, {{6, 10}, {2, 3}, 7}}));
  set.Insert({{4, 6}, {2, 3}, 7});
  EXPECT_EQ(set.fragments(), (std::vector<Fragment>{{{0, 10}, {2, 3}, 7}}));
}

TEST(FragmentSet, KeepsFragmentsOfOtherImagesAndIntervalsApart) {
  FragmentSet set;
  set.Insert({{4, 8}, {0, 1}, 1});
  set.Insert({{8, 9}, {0, 1}, 2});
  set.Insert({{0, 4}, {0, 2}, 1});
  EXPECT_EQ(set.fragments().size(), 3U);
  EXPECT_TRUE(set.Uses(2));
  EXPECT_FALSE(set.Uses(3));
}

TEST(FragmentSet, AgreesWithAnArrayOfPixels) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  constexpr int kPixels = 24;
  for (int trial = 0; trial < 200; ++trial) {
    FragmentSet set;
    std::vector<std::optional<ImageHandle>> pixels(kPixels);
    for (int operation = 0; operation < 30; ++operation) {
      const int begin = random.Integer(0, kPixels - 1), end = random.Integer(begin + 1, kPixels);
      const PixelRange range{std::uint64_t(begin), std::uint64_t(end)};
      std::uint64_t expected = 0, taken = 0;
      for (int i = begin; i < end; ++i) expected += pixels[i].has_value() ? 1 : 0;
      for (const Fragment& part : set.Take(range)) {
        taken += PixelCount(part.pixels);
        for (std::uint64_t i = part.pixels.begin; i < part.pixels.end; ++i) EXPECT_EQ(pixels[i], part.image);
      }
      EXPECT_EQ(taken, expected);
      for (int i = begin; i < end; ++i) pixels[i].reset();
      if (random.Chance(0.7)) {
        const ImageHandle image = random.Integer<ImageHandle>(1, 3);
        set.Insert({range, {0, 1}, image});
        for (int i = begin; i < end; ++i) pixels[i] = image;
      }
      std::uint64_t held = 0;
      for (const Fragment& fragment : set.fragments()) held += PixelCount(fragment.pixels);
      EXPECT_EQ(held, std::uint64_t(std::count_if(pixels.begin(), pixels.end(), [](const auto& p) { return p.has_value(); })));
    }
  }
}

}  // namespace
}  // namespace slabstream
