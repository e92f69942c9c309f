#include "common/image/finite.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<float> Numbers(Random& random, std::size_t count) {
  constexpr float kExtremes[] = {
      0, -0.0F, 1e-45F, std::numeric_limits<float>::min(), std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  std::vector<float> numbers(count);
  for (float& number : numbers) number = random.Chance(0.2) ? kExtremes[random.Integer(0, 5)] : float(random.Real(-1e6, 1e6));
  return numbers;
}

TEST(Finite, OneBadValueAnywhereIsFound) {
  Random random(81);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (std::size_t count = 0; count < 150; ++count) {
      std::vector<float> numbers = Numbers(random, count);
      EXPECT_TRUE(AllFinite(std::as_bytes(std::span(numbers))));
      EXPECT_TRUE(AllDepths(numbers));
      for (std::size_t i = 0; i < count; ++i) {
        for (const float bad : {kInfinity, -kInfinity, kNan, std::copysign(kNan, -1.0F), std::numeric_limits<float>::signaling_NaN()}) {
          const float good = std::exchange(numbers[i], bad);
          EXPECT_FALSE(AllFinite(std::as_bytes(std::span(numbers)))) << bad << " at " << i << " of " << count;
          EXPECT_EQ(AllDepths(numbers), bad == kInfinity) << bad << " at " << i << " of " << count;
          numbers[i] = good;
        }
      }
    }
  });
}

TEST(Finite, AtAnyAddressAndOfAnyLength) {
  Random random(82);
  SCOPED_TRACE(random.trace());
  ForEachTarget([&] {
    for (const std::size_t count : {1U, 63U, 16383U, 16384U, 16385U, 40000U}) {
      std::vector<float> numbers = Numbers(random, count);
      std::vector<std::byte> shifted(sizeof(float) * count + 1);
      const std::span<const std::byte> at_odd(shifted.data() + 1, sizeof(float) * count);
      std::memcpy(shifted.data() + 1, numbers.data(), sizeof(float) * count);
      EXPECT_TRUE(AllFinite(at_odd));
      numbers.back() = kNan;
      std::memcpy(shifted.data() + 1, numbers.data(), sizeof(float) * count);
      EXPECT_FALSE(AllFinite(at_odd));
      EXPECT_TRUE(AllFinite(at_odd.first(sizeof(float) * (count - 1))));
    }
  });
}

}  // namespace
}  // namespace slabstream
