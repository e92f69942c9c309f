// What SamplePixels says of pictures whose filled pixels are counted.
#include "common/image/coverage_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/image/local_image.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

// An ellipse that fills a part of its bounds, as the screen image of a box does, somewhere in the frame.
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

TEST(SamplePixels, CountsSmallImages) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    std::uint64_t filled = 0;
    const LocalImage image = Ellipse(random, random.Integer(1, 64), random.Integer(1, 64), filled);
    EXPECT_EQ(SamplePixels(image), filled);
  }
}

TEST(SamplePixels, EstimatesLargeOnesToAFewPercent) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    std::uint64_t filled = 0;
    const LocalImage image = Ellipse(random, random.Integer(65, 700), random.Integer(65, 700), filled);
    EXPECT_NEAR(double(SamplePixels(image)), double(filled), 0.05 * double(filled))
        << image.bounds.width() << " x " << image.bounds.height();
  }
}

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
