#include "common/image/resolve.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/image/local_image.h"
#include "tests/support/random_image.h"
#include "tests/support/same_image.h"

namespace slabstream {
namespace {

TEST(MakeLocalImage, IsEmptyEverywhere) {
  const LocalImage rgba = MakeLocalImage(PixelFormat::kRgba, {1, 2, 4, 4});
  EXPECT_EQ(rgba.rgba, PooledVector<float>(4 * 6, 0.0F));
  EXPECT_TRUE(rgba.depth.empty());
  EXPECT_TRUE(rgba.voxel.empty());
  const LocalImage depth = MakeLocalImage(PixelFormat::kDepth, {1, 2, 4, 4});
  EXPECT_EQ(depth.depth, PooledVector<float>(6, std::numeric_limits<float>::infinity()));
  EXPECT_EQ(depth.voxel.size(), 6U);
  EXPECT_TRUE(MakeLocalImage(PixelFormat::kDepth, {3, 3, 1, 1}).rgba.empty());
}

TEST(Resolve, OneIsTheIdentity) {
  Random random(41);
  SCOPED_TRACE(random.trace());
  const LocalImage image = RandomImage(random, PixelFormat::kDepth, {3, 1, 9, 7});
  ExpectSameBits(Resolve(image, 1), image);
}

TEST(Resolve, AveragesColourAndKeepsTheNearestDepth) {
  Random random(42);
  SCOPED_TRACE(random.trace());
  for (int supersample : {2, 4, 8}) {
    for (int i = 0; i < 30; ++i) {
      const PixelBounds fine = RandomBounds(random, {0, 0, 40, 24});
      const LocalImage image = RandomImage(random, i % 2 ? PixelFormat::kRgba : PixelFormat::kDepth, fine);
      const LocalImage result = Resolve(image, supersample);
      EXPECT_TRUE(PixelBounds({0, 0, 40 / supersample, 24 / supersample}).Contains(result.bounds));
      // Every fine pixel lies in a final one, and no final pixel is without fine ones.
      EXPECT_EQ(result.bounds.empty(), fine.empty());
      for (std::int32_t y = result.bounds.y_begin; y < result.bounds.y_end; ++y) {
        for (std::int32_t x = result.bounds.x_begin; x < result.bounds.x_end; ++x) {
          const PixelBounds cell = Intersection(fine, {x * supersample, y * supersample, (x + 1) * supersample, (y + 1) * supersample});
          ASSERT_FALSE(cell.empty());
          double sum[4] = {};
          float nearest = std::numeric_limits<float>::infinity();
          for (std::int32_t fy = cell.y_begin; fy < cell.y_end; ++fy) {
            for (std::int32_t fx = cell.x_begin; fx < cell.x_end; ++fx) {
              const auto source = std::size_t(fy - fine.y_begin) * std::size_t(fine.width()) + std::size_t(fx - fine.x_begin);
              for (std::size_t channel = 0; channel < 4; ++channel) sum[channel] += double(image.rgba[4 * source + channel]);
              if (image.format == PixelFormat::kDepth) nearest = std::min(nearest, image.depth[source]);
            }
          }
          const auto target =
              std::size_t(y - result.bounds.y_begin) * std::size_t(result.bounds.width()) + std::size_t(x - result.bounds.x_begin);
          for (std::size_t channel = 0; channel < 4; ++channel) {
            EXPECT_FLOAT_EQ(result.rgba[4 * target + channel], float(sum[channel] / (supersample * supersample)));
          }
          if (image.format == PixelFormat::kDepth) {
            EXPECT_EQ(result.depth[target], nearest);
          }
        }
      }
    }
  }
}

TEST(Resolve, BoundsHoldEveryFinePixel) {
  const LocalImage result = Resolve(MakeLocalImage(PixelFormat::kRgba, {3, 4, 5, 9}), 4);
  EXPECT_EQ(result.bounds, (PixelBounds{0, 1, 2, 3}));
}

}  // namespace
}  // namespace slabstream
