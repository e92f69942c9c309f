// From the frame of splatting to the picture: every instruction set against the reference, and the reference against what it stands for.
#include "common/kernels/resample.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/image/add_image.h"
#include "common/image/image_view.h"
#include "tests/common/kernels/resample_reference.h"
#include "tests/support/random_image.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

LocalImage Picture(std::int32_t width, std::int32_t height) { return MakeLocalImage(PixelFormat::kRgba, {0, 0, width, height}); }

LocalImage Resampled(const LocalImage& frame, const ProjectiveMap& map, std::int32_t width, std::int32_t height) {
  LocalImage picture = Picture(width, height);
  ResampleRowsReference(frame, map, 0, height, picture);
  return picture;
}

float At(const LocalImage& picture, std::int32_t x, std::int32_t y, std::size_t channel) {
  return picture.rgba[4 * (std::size_t(y) * std::size_t(picture.bounds.width()) + std::size_t(x)) + channel];
}

// Turns, skews, shifts; one of the picture's pixels is `scale` of the frame's, roughly; under perspective, W changes by up to half its
// value over a picture of 40 x 30 pixels.
ProjectiveMap RandomMap(Random& random, double scale, bool perspective) {
  const double angle = random.Real(0, 6.28), skew = random.Real(-0.4, 0.4);
  ProjectiveMap map = {
      scale * std::cos(angle), scale * (skew - std::sin(angle)), 0, scale * std::sin(angle), scale * std::cos(angle), 0, 0, 0, 1};
  if (perspective) map[6] = random.Real(-0.006, 0.006), map[7] = random.Real(-0.008, 0.008);
  // The picture's middle lies in the frame's.
  const double w = map[6] * 20 + map[7] * 15 + map[8];
  map[2] = 25 * w - map[0] * 20 - map[1] * 15;
  map[5] = 20 * w - map[3] * 20 - map[4] * 15;
  return map;
}

TEST(ResampleRows, AgreesWithTheReference) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  for (double scale : {0.05, 0.5, 1.0, 1.3, 2.5, 9.0, 40.0, 500.0}) {
    for (int i = 0; i < 6; ++i) {
      const bool perspective = i % 2 == 1;
      // Within the frame and across its borders.
      const LocalImage frame = RandomImage(random, PixelFormat::kRgba, {random.Integer(0, 8), random.Integer(0, 8), 50, 40});
      const ProjectiveMap map = RandomMap(random, scale, perspective);
      const LocalImage expected = Resampled(frame, map, 40, 30);
      ForEachTarget([&] {
        LocalImage picture = Picture(40, 30);
        ResampleRows(frame, map, 0, 30, picture);
        for (std::size_t k = 0; k < picture.rgba.size(); ++k) {
          ASSERT_NEAR(picture.rgba[k], expected.rgba[k], 3e-6F) << "scale " << scale << " perspective " << perspective << " at " << k;
        }
      });
    }
  }
}

TEST(ResampleRows, WritesItsRowsOnly) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  const LocalImage frame = RandomImage(random, PixelFormat::kRgba, {0, 0, 50, 40});
  const ProjectiveMap map = RandomMap(random, 1, true);
  LocalImage whole = Picture(40, 30), parts = Picture(40, 30);
  ResampleRows(frame, map, 0, 30, whole);
  for (std::int32_t y = 0; y < 30; y += 7) ResampleRows(frame, map, y, std::min(y + 7, 30), parts);
  EXPECT_EQ(whole.rgba, parts.rgba);
}

// As the shares of a picture that several workers finish.
TEST(ResampleRows, PartsOfAFrameAddUpToTheWhole) {
  Random random(67);
  SCOPED_TRACE(random.trace());
  for (int trial = 0; trial < 60; ++trial) {
    const LocalImage frame = RandomImage(random, PixelFormat::kRgba, {0, 0, 50, 40});
    const ProjectiveMap map = RandomMap(random, std::exp(random.Real(-1.5, 1.5)), trial % 2 == 1);
    LocalImage whole = Picture(40, 30), sum = Picture(40, 30);
    ResampleRows(frame, map, 0, 30, whole);
    std::uint64_t begin = 0;
    while (begin < 2000) {
      const std::uint64_t end = std::min<std::uint64_t>(2000, begin + random.Integer<std::uint64_t>(1, 900));
      LocalImage part = CopyOf(ViewOf(frame, {begin, end}, 50));
      FillRows(part);
      LocalImage picture = MakeLocalImage(PixelFormat::kRgba, ReachedPixels(part.bounds, map, 40, 30));
      ResampleRows(part, map, picture.bounds.y_begin, picture.bounds.y_end, picture);
      AddImage(sum, picture);
      begin = end;
    }
    for (std::size_t i = 0; i < whole.rgba.size(); ++i) ASSERT_NEAR(sum.rgba[i], whole.rgba[i], 2e-6F) << "trial " << trial;
  }
}

// Weights are not negative and sum to 1.
TEST(ResampleRows, KeepsConstantsAndNeverExceedsTheFrame) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  LocalImage filled = MakeLocalImage(PixelFormat::kRgba, {0, 0, 50, 40});
  std::ranges::fill(filled.rgba, 0.625F);
  for (double scale : {0.05, 0.7, 1.1, 3.0, 20.0}) {
    const LocalImage picture = Resampled(filled, RandomMap(random, scale, true), 40, 30);
    for (float value : picture.rgba) {
      EXPECT_GE(value, 0);
      EXPECT_LE(value, 0.625F + 1e-6F);
    }
    if (scale < 5) {
      EXPECT_NEAR(At(picture, 20, 15, 3), 0.625F, 1e-6F) << scale;
    }
  }
}

// A quadratic B-spline reproduces straight lines: places are right.
TEST(ResampleRows, ReproducesRampsUnderMagnification) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  LocalImage ramp = MakeLocalImage(PixelFormat::kRgba, {0, 0, 50, 40});
  for (std::int32_t y = 0; y < 40; ++y) {
    for (std::int32_t x = 0; x < 50; ++x) {
      float* pixel = &ramp.rgba[4 * (std::size_t(y) * 50 + std::size_t(x))];
      pixel[0] = float(x) + 0.5F, pixel[1] = float(y) + 0.5F, pixel[2] = pixel[3] = 1;
    }
  }
  for (bool perspective : {false, true}) {
    const ProjectiveMap map = RandomMap(random, 0.3, perspective);
    const LocalImage picture = Resampled(ramp, map, 40, 30);
    for (std::int32_t y = 0; y < 30; ++y) {
      for (std::int32_t x = 0; x < 40; ++x) {
        const double w = map[6] * (x + 0.5) + map[7] * (y + 0.5) + map[8];
        EXPECT_NEAR(At(picture, x, y, 0), (map[0] * (x + 0.5) + map[1] * (y + 0.5) + map[2]) / w, 1e-4);
        EXPECT_NEAR(At(picture, x, y, 1), (map[3] * (x + 0.5) + map[4] * (y + 0.5) + map[5]) / w, 1e-4);
      }
    }
  }
}

// Minified pictures do not alias: a pattern as fine as the frame's pixels becomes its mean, and nothing gets lost between pixels.
TEST(ResampleRows, MinifiedPicturesHoldTheMean) {
  constexpr double kScale = 4.3;
  LocalImage stripes = MakeLocalImage(PixelFormat::kRgba, {0, 0, 400, 400});
  double sum = 0;
  for (std::size_t p = 0; p < 400 * 400; ++p) {
    for (std::size_t c = 0; c < 4; ++c) stripes.rgba[4 * p + c] = p % 2 == 0 ? 1.0F : 0.0F;
    sum += p % 2 == 0 ? 1 : 0;
  }
  const ProjectiveMap map = {kScale, 0, -10, 0, kScale, -10, 0, 0, 1};
  const LocalImage picture = Resampled(stripes, map, 120, 120);
  double got = 0;
  for (std::int32_t y = 0; y < 120; ++y) {
    for (std::int32_t x = 0; x < 120; ++x) {
      got += double(At(picture, x, y, 3));
      if (x >= 8 && x < 90 && y >= 8 && y < 90) {
        EXPECT_NEAR(At(picture, x, y, 3), 0.5F, 0.01F);
      }
    }
  }
  EXPECT_NEAR(got * kScale * kScale, sum, 0.001 * sum);
}

// Places before which no slice lies, and those near the horizon where a pixel would see half of the frame: no garbage, and an end.
TEST(ResampleRows, PlacesBeyondTheHorizonAreEmpty) {
  LocalImage filled = MakeLocalImage(PixelFormat::kRgba, {0, 0, 500, 400});
  std::ranges::fill(filled.rgba, 1.0F);
  const ProjectiveMap map = {100, 0, 100, 0, 100, 0, -0.05, 0, 1.003};  // W = 0 at x = 20.06
  LocalImage picture = Picture(40, 30);
  ResampleRows(filled, map, 0, 30, picture);
  for (std::int32_t y = 0; y < 30; ++y) {
    for (std::int32_t x = 0; x < 40; ++x) {
      ASSERT_TRUE(std::isfinite(At(picture, x, y, 3)));
      if (x >= 20) {
        EXPECT_EQ(At(picture, x, y, 3), 0);
      }
    }
  }
  EXPECT_GT(At(picture, 1, 1, 3), 0.5F);
}

}  // namespace
}  // namespace slabstream
