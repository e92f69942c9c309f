// What SamplePixels says of pictures whose filled pixels are counted.
#include "common/image/coverage_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/image/local_image.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// An ellipse that fills a part of its bounds, as the screen image of a box does, somewhere in the frame. `filled`: its pixels.
LocalImage Ellipse(Random& random, std::int32_t width, std::int32_t height, std::uint64_t& filled) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {7, 11, 7 + width, 11 + height});
  const double x_radius = width * random.Real(0.3, 0.5), y_radius = height * random.Real(0.3, 0.5);
  filled = 0;
  for (std::int32_t y = 0; y < height; ++y) {
    for (std::int32_t x = 0; x < width; ++x) {
      if (std::hypot((x + 0.5 - width / 2.0) / x_radius, (y + 0.5 - height / 2.0) / y_radius) > 1) continue;
      image.rgba[4 * (std::size_t(y) * std::size_t(width) + std::size_t(x)) + 3] = 0.5F;
      ++filled;
    }
  }
  return image;
}

// Ellipses whose sides are at least `least` and at most `most` pixels; the error as a share of the filled pixels.
void ExpectSamplePixelsNear(std::uint64_t seed, std::int32_t least, std::int32_t most, double error) {
  Random random(seed);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    std::uint64_t filled = 0;
    const LocalImage image = Ellipse(random, random.Integer(least, most), random.Integer(least, most), filled);
    EXPECT_NEAR(double(SamplePixels(image)), double(filled), error * double(filled))
        << image.bounds.width() << " x " << image.bounds.height();
  }
}

TEST(SamplePixels, CountsSmallImages) { ExpectSamplePixelsNear(71, 1, 64, 0); }

TEST(SamplePixels, EstimatesLargeOnesToAFewPercent) { ExpectSamplePixelsNear(72, 65, 700, 0.05); }

TEST(SamplePixels, KnowsEmptyAndFullImagesOfAnyShape) {
  Random random(73);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, random.Integer(1, 9000), random.Integer(4, 40)});
    EXPECT_EQ(SamplePixels(image), 0U);
    for (std::size_t pixel = 0; pixel < std::size_t(image.bounds.pixel_count()); ++pixel) image.rgba[4 * pixel + 3] = 1;
    EXPECT_EQ(SamplePixels(image), std::uint64_t(image.bounds.pixel_count()));
  }
}

}  // namespace
}  // namespace slabstream
