#include "common/combining/fragments.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

using List = Fragments<int>::List;

TEST(Fragments, CutsAndJoins) {
  Fragments<int> held;
  held.Put({{0, 10}, 7});
  EXPECT_EQ(held.Take({4, 6}), (List{{{4, 6}, 7}}));
  EXPECT_EQ(held.list(), (List{{{0, 4}, 7}, {{6, 10}, 7}}));
  held.Put({{4, 6}, 7});
  EXPECT_EQ(held.list(), (List{{{0, 10}, 7}}));
}

TEST(Fragments, KeepsOtherValuesApart) {
  Fragments<int> held;
  held.Put({{4, 8}, 1});
  held.Put({{8, 9}, 2});
  held.Put({{0, 4}, 3});
  EXPECT_EQ(held.list(), (List{{{0, 4}, 3}, {{4, 8}, 1}, {{8, 9}, 2}}));
}

TEST(Fragments, CombinesWhereSomethingIsHeld) {
  Fragments<int> held;
  held.Put({{2, 4}, 1});
  held.Put({{6, 8}, 10});
  EXPECT_TRUE(held.Combine({{0, 7}, 100}, [](int a, int b) { return std::optional(a + b); }));
  EXPECT_EQ(held.list(), (List{{{0, 2}, 100}, {{2, 4}, 101}, {{4, 6}, 100}, {{6, 7}, 110}, {{7, 8}, 10}}));
  EXPECT_FALSE(held.Combine({{0, 1}, 1}, [](int, int) { return std::optional<int>(); }));
}

TEST(Fragments, AgreeWithAnArrayOfPixels) {
  Random random(1);
  SCOPED_TRACE(random.trace());
  constexpr int kPixels = 24;
  for (int trial = 0; trial < 200; ++trial) {
    Fragments<int> held;
    std::vector<std::optional<int>> pixels(kPixels);
    const auto same = [&](const List& parts, const PixelRange& range) {
      std::vector<std::optional<int>> found(kPixels);
      for (const Fragment<int>& part : parts) {
        EXPECT_LT(part.pixels.begin, part.pixels.end);
        for (std::uint64_t i = part.pixels.begin; i < part.pixels.end; ++i) found[i] = part.value;
      }
      for (int i = 0; i < kPixels; ++i) {
        EXPECT_EQ(found[i], std::uint64_t(i) >= range.begin && std::uint64_t(i) < range.end ? pixels[i] : std::nullopt);
      }
    };
    for (int operation = 0; operation < 30; ++operation) {
      const int begin = random.Integer(0, kPixels - 1), end = random.Integer(begin + 1, kPixels);
      const PixelRange range{std::uint64_t(begin), std::uint64_t(end)};
      same(held.Within(range), range);
      same(held.Take(range), range);
      for (int i = begin; i < end; ++i) pixels[i].reset();
      if (random.Chance(0.7)) {
        const int value = random.Integer(1, 3);
        held.Put({range, value});
        for (int i = begin; i < end; ++i) pixels[i] = value;
      }
      same(held.list(), {0, kPixels});
      for (std::size_t i = 1; i < held.list().size(); ++i) {
        const Fragment<int>&before = held.list()[i - 1], &after = held.list()[i];
        EXPECT_TRUE(before.pixels.end < after.pixels.begin || before.value != after.value) << "neighbours are not joined";
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
