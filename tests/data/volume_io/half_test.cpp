#include "data/volume_io/half.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace slabstream {
namespace {

Half OfBits(int bits) { return std::bit_cast<Half>(std::uint16_t(bits)); }

TEST(Half, EveryCodeIsTheHalfOfItsValue) {
  for (int bits = 0; bits < 0x10000; ++bits) {
    const float value = OfBits(bits);
    const bool nan = (bits & 0x7fff) > 0x7c00;
    ASSERT_EQ(std::isnan(value), nan) << bits;
    if (nan) continue;
    ASSERT_EQ(Half(double(value)).bits, bits);
  }
}

TEST(Half, ValuesAreThoseOfTheStandard) {
  const auto value = [](int bits) { return double(OfBits(bits)); };
  EXPECT_EQ(value(0x3c00), 1);
  EXPECT_EQ(value(0xc000), -2);
  EXPECT_EQ(value(0x7bff), 65504);
  EXPECT_EQ(value(0x0400), 0x1p-14);
  EXPECT_EQ(value(0x0001), 0x1p-24);
  EXPECT_EQ(value(0x7c00), INFINITY);
  EXPECT_EQ(value(0xfc00), -INFINITY);
}

TEST(Half, RoundsToTheNearestAndTiesToEven) {
  for (int bits = 0; bits < 0x7bff; ++bits) {
    const double low = OfBits(bits), high = OfBits(bits + 1), middle = (low + high) / 2;
    ASSERT_EQ(Half(middle).bits, bits + bits % 2) << low;
    ASSERT_EQ(Half(std::nextafter(middle, low)).bits, bits);
    ASSERT_EQ(Half(std::nextafter(middle, high)).bits, bits + 1);
  }
  EXPECT_EQ(Half(65520).bits, 0x7c00);
  EXPECT_EQ(Half(std::nextafter(65520, 0)).bits, 0x7bff);
  EXPECT_EQ(Half(1e300).bits, 0x7c00);
}

}  // namespace
}  // namespace slabstream
