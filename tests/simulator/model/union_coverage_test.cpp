#include "simulator/model/union_coverage.h"
#include "common/image/run_image.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random_image.h"

namespace slabstream {
namespace {

TEST(CoverageMap, CountsEveryPixelOnce) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int run = 0; run < 20; ++run) {
    const std::int32_t width = random.Integer(1, 70), height = random.Integer(1, 70);
    for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
      const LocalImage image = RandomImage(random, format, {0, 0, width, height});
      const CoverageMap map = FindCoverage(image, width, height);
      const RunImage runs = EncodeRuns(image, {0, std::uint64_t(width) * std::uint64_t(height)}, width);
      EXPECT_NEAR(map.pixels(), double(runs.header.pixel_count), 1e-3);
      for (const float share : map.share) EXPECT_TRUE(share >= 0 && share <= 1) << share;
    }
  }
}

TEST(CoverageMap, SamplesTellTheShareOfLargeImages) {
  Random random(7);
  SCOPED_TRACE(random.trace());
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    for (const std::int32_t side : {0, 1, 5, 64}) {  // few pixels: all are looked at
      const LocalImage image = RandomImage(random, format, {0, 0, side, side});
      const std::uint64_t exact = side == 0 ? 0 : std::uint64_t(FindCoverage(image, side, side).pixels() + 0.5);
      EXPECT_EQ(SamplePixels(image), exact) << side;
    }
    LocalImage image = MakeLocalImage(format, {10, 20, 410, 320});
    for (std::int32_t y = 100; y < 250; ++y) {
      for (std::int32_t x = 50; x < 200; ++x) {
        const std::size_t pixel = std::size_t(y) * 400 + std::size_t(x);
        image.rgba[4 * pixel + 3] = 1;
        if (format == PixelFormat::kDepth) image.depth[pixel] = 1;
      }
    }
    EXPECT_NEAR(double(SamplePixels(image)), 150 * 150, 0.06 * 150 * 150);  // half a step at each border
  }
}

TEST(CoverageMap, UniformHoldsWhatItIsGiven) {
  const CoverageMap map = UniformCoverage({5, 20, 45, 33}, 100, 50, 40);
  EXPECT_NEAR(map.pixels(), 100, 1e-3);
  EXPECT_EQ(map.at(0, 0), 0);
  EXPECT_GT(map.at(0, 1), 0);
}

TEST(UnionCoverage, OneRankIsItself) {
  const CoverageMap map = UniformCoverage({0, 0, 64, 64}, 1024, 64, 64);
  const CoverageMap* ranks[] = {&map, nullptr};
  const UnionCoverage all(ranks, 64, 64);
  EXPECT_NEAR(all.Of({0, 1}, {0, 4096}).filled, 1024, 1e-2);
  EXPECT_NEAR(all.Of({0, 2}, {0, 4096}).filled, 1024, 1e-2);
  EXPECT_EQ(all.Of({1, 2}, {0, 4096}).filled, 0);
  EXPECT_NEAR(all.Of({0, 1}, {0, 1024}).filled, 256, 1e-2);
  EXPECT_NEAR(all.Of({0, 1}, {32, 96}).filled, 16, 1e-2);
  EXPECT_EQ(all.Of({0, 1}, {7, 7}).filled, 0);
}

// Between the largest of the ranks and their sum; parts of a range add up; independent of how the interval was put together.
TEST(UnionCoverage, StaysBetweenItsBounds) {
  Random random(4);
  SCOPED_TRACE(random.trace());
  for (int run = 0; run < 20; ++run) {
    const std::int32_t width = random.Integer(1, 100), height = random.Integer(1, 100);
    const std::uint64_t pixels = std::uint64_t(width) * std::uint64_t(height);
    std::vector<CoverageMap> maps;
    for (int rank = 0; rank < 7; ++rank) {
      const std::int32_t x = random.Integer(0, width - 1), y = random.Integer(0, height - 1);
      const PixelBounds bounds = {x, y, random.Integer(x + 1, width), random.Integer(y + 1, height)};
      maps.push_back(UniformCoverage(bounds, random.Real(0, 1) * double(bounds.pixel_count()), width, height));
    }
    std::vector<const CoverageMap*> ranks;
    double sum = 0, most = 0;
    for (const CoverageMap& map : maps) {
      ranks.push_back(&map);
      sum += map.pixels();
      most = std::max(most, map.pixels());
    }
    const UnionCoverage all(ranks, width, height);
    const UnionCoverage::Amount whole = all.Of({0, 7}, {0, pixels});
    EXPECT_LE(whole.filled, std::min(sum, double(pixels)) + 0.01);
    EXPECT_GE(whole.filled, most - 0.01);
    EXPECT_LE(whole.filled, whole.scanned + 0.01);
    const std::uint64_t cut = random.Integer<std::uint64_t>(0, pixels);
    EXPECT_NEAR(all.Of({0, 7}, {0, cut}).filled + all.Of({0, 7}, {cut, pixels}).filled, whole.filled, 0.01);
  }
}

}  // namespace
}  // namespace slabstream
