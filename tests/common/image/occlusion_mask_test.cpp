#include "common/image/occlusion_mask.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/image/local_image.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

constexpr double kTermination = 1.0 / 1024;

void SetAlpha(LocalImage& image, std::int32_t x, std::int32_t y, float alpha) {
  const PixelBounds& b = image.bounds;
  image.rgba[4 * (std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin)) + 3] = alpha;
}

LocalImage Filled(const PixelBounds& bounds, float alpha) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, bounds);
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = alpha;
  return image;
}

// A tile of the frame, by its definition.
bool AllOpaque(const LocalImage& image, std::int32_t width, std::int32_t height, std::int32_t tile_x, std::int32_t tile_y) {
  const PixelBounds& b = image.bounds;
  for (std::int32_t y = tile_y * kOcclusionTile; y < std::min((tile_y + 1) * kOcclusionTile, height); ++y) {
    for (std::int32_t x = tile_x * kOcclusionTile; x < std::min((tile_x + 1) * kOcclusionTile, width); ++x) {
      if (!b.Contains({x, y, x + 1, y + 1})) return false;
      const auto index = std::size_t(y - b.y_begin) * std::size_t(b.width()) + std::size_t(x - b.x_begin);
      if (1 - image.rgba[4 * index + 3] > float(kTermination)) return false;
    }
  }
  return true;
}

TEST(OcclusionMask, ATileIsHiddenIfAllItsPixelsAreOpaque) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  int hidden = 0, open = 0;
  for (int round = 0; round < 300; ++round) {
    const std::int32_t width = random.Integer(1, 70), height = random.Integer(1, 70);
    // Bounds that begin and end within tiles, or at the frame's border, where tiles are cut.
    PixelBounds bounds{random.Integer(0, width / 3), random.Integer(0, height / 3), width - random.Integer(0, width / 3),
                       height - random.Integer(0, height / 3)};
    LocalImage image = Filled(bounds, random.Chance(0.5) ? 1.0F : float(1 - kTermination));
    for (int i = random.Integer(0, 4); i > 0; --i) {
      SetAlpha(image, random.Integer(bounds.x_begin, bounds.x_end - 1), random.Integer(bounds.y_begin, bounds.y_end - 1), 0.998F);
    }
    const OcclusionMask mask = FindHiddenTiles(image, width, height, kTermination);
    for (std::int32_t y = 0; y < height; ++y) {
      for (std::int32_t x = 0; x < width; ++x) {
        const bool expected = AllOpaque(image, width, height, x / kOcclusionTile, y / kOcclusionTile);
        ASSERT_EQ(mask.Hides(x, y), expected) << width << " x " << height << ", pixel " << x << ", " << y << ", round " << round;
        ++(expected ? hidden : open);
      }
    }
  }
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(open, 1000);
}

TEST(OcclusionMask, NothingHiddenIsTheEmptyMask) {
  EXPECT_TRUE(FindHiddenTiles(Filled({0, 0, 32, 32}, 0.9F), 32, 32, kTermination).empty());
  EXPECT_TRUE(FindHiddenTiles(Filled({0, 0, 32, 32}, 1), 32, 32, 0).empty()) << "termination 0: never";
  EXPECT_TRUE(FindHiddenTiles(Filled({1, 0, 8, 8}, 1), 32, 32, kTermination).empty()) << "a column of the only tile is not there";
  EXPECT_TRUE(FindHiddenTiles(MakeLocalImage(PixelFormat::kRgba, {}), 32, 32, kTermination).empty());
  EXPECT_FALSE(OcclusionMask{}.Hides(5, 5));
}

TEST(OcclusionMask, WhatIsKnownToBeHiddenStaysAndTheRestIsAdded) {
  LocalImage image = Filled({0, 0, 20, 10}, 0);  // 3 x 2 tiles
  for (std::int32_t y = 0; y < 8; ++y) {
    for (std::int32_t x = 0; x < 8; ++x) SetAlpha(image, x, y, 1);
  }
  const OcclusionMask first = FindHiddenTiles(image, 20, 10, kTermination);
  EXPECT_EQ(first, (OcclusionMask{3, 2, {kOcclusionSteps, 0, 0, 0, 0, 0}}));
  for (std::int32_t y = 8; y < 10; ++y) {
    for (std::int32_t x = 16; x < 20; ++x) SetAlpha(image, x, y, 1);
  }
  const OcclusionMask second = FindHiddenTiles(image, 20, 10, kTermination, first);
  EXPECT_EQ(second, (OcclusionMask{3, 2, {kOcclusionSteps, 0, 0, 0, 0, kOcclusionSteps}}));
  EXPECT_EQ(second, FindHiddenTiles(image, 20, 10, kTermination)) << "as if looked for anew";
}

TEST(OcclusionMask, HidesAllOfARectangleIfItHidesEachPixel) {
  Random random(8);
  SCOPED_TRACE(random.trace());
  int all = 0;
  for (int round = 0; round < 2000; ++round) {
    const std::int32_t width = random.Integer(1, 80), height = random.Integer(1, 80);
    OcclusionMask mask{OcclusionTiles(width), OcclusionTiles(height), {}};
    for (std::int32_t i = 0; i < mask.tiles_x * mask.tiles_y; ++i) mask.steps.push_back(random.Chance(0.8) ? kOcclusionSteps : 0);
    const std::int32_t x = random.Integer(0, width - 1), y = random.Integer(0, height - 1);
    const PixelBounds bounds{x, y, random.Integer(x + 1, width), random.Integer(y + 1, height)};
    bool expected = true;
    for (std::int32_t row = bounds.y_begin; row < bounds.y_end; ++row) {
      for (std::int32_t column = bounds.x_begin; column < bounds.x_end; ++column) expected = expected && mask.Hides(column, row);
    }
    EXPECT_EQ(mask.HidesAll(bounds), expected);
    all += expected ? 1 : 0;
  }
  EXPECT_GT(all, 100);
  EXPECT_TRUE(OcclusionMask{}.HidesAll({}));
  EXPECT_FALSE(OcclusionMask{}.HidesAll({0, 0, 1, 1}));
}

}  // namespace
}  // namespace slabstream
