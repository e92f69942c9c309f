#include "common/image/picture_image.h"

#include <gtest/gtest.h>

#include <vector>

#include "common/image/sample_codes.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// Codes, some of whose rows and columns at the border are empty.
StraightImage RandomCodes(Random& random, const PixelBounds& bounds) {
  StraightImage image = MakeStraightImage(bounds);
  for (std::size_t i = 0; i < image.codes.size(); i += 4) {
    if (random.Chance(0.9)) continue;
    for (std::size_t c = 0; c < 3; ++c) image.codes[i + c] = std::uint8_t(random.Integer(0, 255));
    image.codes[i + 3] = std::uint8_t(random.Integer(1, 255));
  }
  return image;
}

LocalImage FloatsOf(const StraightImage& codes) {
  LocalImage floats = MakeLocalImage(PixelFormat::kRgba, codes.bounds);
  FromStraightCodes(codes.codes.data(), std::size_t(codes.bounds.pixel_count()), floats.rgba.data());
  return floats;
}

TEST(PictureImage, SaysTheSameOfFloatsAndOfTheirCodes) {
  Random random(5);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    const std::int32_t x = random.Integer(0, 5), y = random.Integer(0, 5);
    const PixelBounds bounds{x, y, x + random.Integer(1, 6), y + random.Integer(1, 6)};
    const PictureImage codes = RandomCodes(random, bounds), floats = FloatsOf(*codes.codes());
    EXPECT_EQ(codes.bounds(), bounds);
    EXPECT_EQ(codes.IsEmpty(), floats.IsEmpty());
    EXPECT_EQ(codes.ContentBounds(), floats.ContentBounds());
    EXPECT_EQ(codes.ContentBounds().empty(), codes.IsEmpty());
    std::vector<float> of_codes(4 * std::size_t(bounds.width())), of_floats(of_codes.size());
    for (std::int32_t row = bounds.y_begin; row < bounds.y_end; ++row) {
      codes.ReadColors(row, of_codes.data());
      floats.ReadColors(row, of_floats.data());
      EXPECT_EQ(of_codes, of_floats);
    }
  }
}

TEST(PictureImage, ContentBoundsAreTheSmallestRectangleThatHoldsAllPixels) {
  Random random(6);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 300; ++round) {
    const PixelBounds bounds{3, 4, 3 + random.Integer(1, 8), 4 + random.Integer(1, 8)};
    const StraightImage codes = RandomCodes(random, bounds);
    PixelBounds expected;
    for (std::int32_t y = bounds.y_begin; y < bounds.y_end; ++y) {
      for (std::int32_t x = bounds.x_begin; x < bounds.x_end; ++x) {
        const auto index = std::size_t(y - bounds.y_begin) * std::size_t(bounds.width()) + std::size_t(x - bounds.x_begin);
        if (codes.codes[4 * index + 3] > 0) expected = Union(expected, {x, y, x + 1, y + 1});
      }
    }
    EXPECT_EQ(PictureImage(codes).ContentBounds(), expected);
  }
}

TEST(PictureImage, IsEmptyFromTheStart) {
  EXPECT_TRUE(PictureImage().bounds().empty());
  EXPECT_TRUE(PictureImage().IsEmpty());
  EXPECT_FALSE(PictureImage().has_depth());
  EXPECT_TRUE(PictureImage(MakeLocalImage(PixelFormat::kRgbaDepth, {0, 0, 2, 2})).has_depth());
}

}  // namespace
}  // namespace slabstream
