// Codes of samples: known values, and every instruction set against the reference.

#include "tests/common/image/sample_codes_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/random.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

// Many samples that lie at a half between two codes or just beside it, some outside [0, 1].
float AnySample(Random& random) {
  if (random.Chance(0.1)) return float(random.Integer(-1, 2));
  if (random.Chance(0.3)) return float(random.Real(-0.1, 1.1));
  const float half = (float(random.Integer(0, 255)) + 0.5F) / 255.0F;
  return std::nextafter(half, float(random.Integer(0, 1)));
}

std::vector<float> AnyPixels(Random& random, std::size_t pixels) {
  std::vector<float> rgba(4 * pixels);
  for (float& sample : rgba) sample = AnySample(random);
  for (std::size_t i = 3; i < rgba.size(); i += 4) {
    if (random.Chance(0.2)) rgba[i] = 0;
  }
  return rgba;
}

TEST(SampleCodes, AreRoundedAndClamped) {
  const std::vector<float> samples = {0, 1, 0.5F, 0.25F, -3, 7, 100.4F / 255, 100.6F / 255};
  std::vector<std::uint8_t> codes(samples.size());
  SampleCodes(samples.data(), samples.size(), codes.data());
  EXPECT_EQ(codes, (std::vector<std::uint8_t>{0, 255, 128, 64, 0, 255, 100, 101}));
}

TEST(SampleCodes, OfColorsAreDividedByAlpha) {
  const std::vector<float> rgba = {0.25F, 0.5F, 0.125F, 0.5F, 5e-6F, 5e-6F, 5e-6F, 6e-6F};
  std::vector<std::uint8_t> codes(8);
  std::vector<std::uint16_t> deep(8);
  StraightCodes(rgba.data(), 2, codes.data());
  StraightCodes(rgba.data(), 2, deep.data());
  EXPECT_EQ(codes, (std::vector<std::uint8_t>{128, 255, 64, 128, 0, 0, 0, 0}));
  EXPECT_EQ(deep, (std::vector<std::uint16_t>{32768, 65535, 16384, 32768, 0, 0, 0, 0}));
}

// Also where alpha is tiny, so that its code is 0.
TEST(SampleCodes, OfColorsFromCodesAreTheseCodes) {
  std::vector<std::uint8_t> codes;
  for (int alpha = 0; alpha < 256; ++alpha) {
    for (int color = 0; color < 256; ++color) {
      for (const int sample : {color, 255 - color, color, alpha}) codes.push_back(std::uint8_t(alpha == 0 ? 0 : sample));
    }
  }
  for (const std::size_t pixels : {codes.size() / 4, std::size_t{7}}) {
    ForEachTarget([&] {
      std::vector<float> rgba(4 * pixels);
      FromStraightCodes(codes.data() + codes.size() - rgba.size(), pixels, rgba.data());
      std::vector<std::uint8_t> again(rgba.size());
      StraightCodes(rgba.data(), pixels, again.data());
      EXPECT_TRUE(std::equal(again.begin(), again.end(), codes.end() - std::ptrdiff_t(again.size())));
      EXPECT_EQ(rgba[rgba.size() - 1], 1);
      EXPECT_EQ(rgba[rgba.size() - 4], 1);
    });
  }
}

TEST(SampleCodes, AreThoseOfTheReferenceOnEveryInstructionSet) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  for (std::size_t pixels = 0; pixels < 40; ++pixels) {
    const std::vector<float> rgba = AnyPixels(random, pixels);
    const float alpha = random.Chance(0.5) ? 1 : float(random.Real(0, 1));
    const Premultiplied behind = random.Chance(0.3) ? Premultiplied{} : Premultiplied{0.25F * alpha, alpha, 0, alpha};
    std::vector<std::uint8_t> plain(rgba.size()), straight(rgba.size());
    std::vector<std::uint16_t> deep(rgba.size());
    testing::SampleCodesReference(rgba.data(), rgba.size(), plain.data());
    testing::StraightCodesReference(rgba.data(), pixels, straight.data(), behind);
    testing::StraightCodesReference(rgba.data(), pixels, deep.data(), behind);
    ForEachTarget([&] {
      std::vector<std::uint8_t> codes(rgba.size());
      SampleCodes(rgba.data(), rgba.size(), codes.data());
      EXPECT_EQ(codes, plain);
      StraightCodes(rgba.data(), pixels, codes.data(), behind);
      EXPECT_EQ(codes, straight);
      std::vector<std::uint16_t> deep_codes(rgba.size());
      StraightCodes(rgba.data(), pixels, deep_codes.data(), behind);
      EXPECT_EQ(deep_codes, deep);
    });
  }
}

}  // namespace
}  // namespace slabstream
