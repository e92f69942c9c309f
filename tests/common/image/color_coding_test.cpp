#include "tests/common/image/color_coding_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/image/image_view.h"
#include "common/image/run_image.h"
#include "common/image/sample_codes.h"
#include "tests/support/random_image.h"
#include "tests/support/simd_targets.h"

namespace slabstream {
namespace {

constexpr PixelBounds kCodedFrame = {0, 0, 40, 30};
constexpr ColorCoding kCodings[] = {ColorCoding::kHalf, ColorCoding::kFixed16};

std::vector<float> ManyValues(Random& random) {
  std::vector<float> values = {0,        1,        kLargestColor, 0.5F,       0x1p-14F, std::nextafter(0x1p-14F, 0.0F),
                               0x1p-24F, 0x1p-25F, 1e-40F,        0.99999994F};
  for (int i = 0; i < 20000; ++i) values.push_back(float(std::pow(random.Real(0, 1), random.Integer(1, 8))));
  return values;
}

TEST(ColorCoding, KeepsItsErrorBounds) {
  Random random(71);
  SCOPED_TRACE(random.trace());
  const std::vector<float> values = ManyValues(random);
  std::vector<std::uint16_t> codes(values.size());
  std::vector<float> back(values.size());
  for (const ColorCoding coding : kCodings) {
    ASSERT_TRUE(testing::ToCodesReference(coding, values.data(), codes.data(), values.size()));
    testing::FromCodesReference(coding, codes.data(), back.data(), codes.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = std::min(values[i], 1.0F);
      const double bound = coding == ColorCoding::kHalf ? std::max(value * 0x1p-11, 0x1p-25) : 0.5 / 65535 + 1e-7;
      ASSERT_LE(std::abs(double(back[i]) - value), bound) << values[i];
      ASSERT_LE(codes[i], LargestCode(coding));
    }
  }
}

TEST(ColorCoding, EveryCodeComesBack) {
  for (const ColorCoding coding : kCodings) {
    for (std::uint32_t code = 0; code <= LargestCode(coding); ++code) {
      const auto in = std::uint16_t(code);
      float value = -1, before = -1;
      std::uint16_t out = 0;
      testing::FromCodesReference(coding, &in, &value, 1);
      ASSERT_TRUE(testing::ToCodesReference(coding, &value, &out, 1)) << code;
      ASSERT_EQ(out, in);
      ASSERT_GT(value, before) << "order is kept";
      before = value;
    }
  }
}

TEST(ColorCoding, EveryInstructionSetGivesTheBitsOfTheReference) {
  Random random(72);
  SCOPED_TRACE(random.trace());
  const std::vector<float> values = ManyValues(random);
  ForEachTarget([&] {
    for (const ColorCoding coding : kCodings) {
      for (std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{15}, std::size_t{17}, values.size() - 1}) {
        std::vector<std::uint16_t> expected(count), codes(count + 1, 77);
        std::vector<float> expected_back(count), back(count + 1, -1);
        ASSERT_TRUE(testing::ToCodesReference(coding, values.data() + 1, expected.data(), count));
        ASSERT_TRUE(ToCodes(coding, values.data() + 1, codes.data(), count));
        ASSERT_EQ(codes.back(), 77) << "wrote past the end";
        codes.pop_back();
        ASSERT_EQ(codes, expected);
        testing::FromCodesReference(coding, codes.data(), expected_back.data(), count);
        FromCodes(coding, codes.data(), back.data(), count);
        ASSERT_EQ(back.back(), -1);
        back.pop_back();
        ASSERT_EQ(back, expected_back);
      }
      for (const float bad : {-1e-9F, 1.001F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        for (std::size_t at : {std::size_t{0}, std::size_t{30}, std::size_t{66}}) {
          std::vector<float> row(67, 0.5F);
          row[at] = bad;
          std::vector<std::uint16_t> codes(row.size());
          EXPECT_FALSE(ToCodes(coding, row.data(), codes.data(), row.size())) << bad;
        }
      }
    }
  });
}

TEST(ColorCoding, RunsAreHalfAsLongAndComeBackWithinTheBound) {
  Random random(73);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const LocalImage image = RandomImage(random, PixelFormat::kRgba, RandomBounds(random, kCodedFrame));
    const RunImage exact = EncodeRuns(ViewOf(image));
    for (const ColorCoding coding : kCodings) {
      RunImage coded = EncodeRuns(ViewOf(image), coding);
      EXPECT_EQ(coded.payload.size(), 12 * exact.header.run_count + 8 * exact.header.pixel_count);
      const LocalImage a = ReadRuns(exact.header, exact.payload, kCodedFrame).value();
      const LocalImage b = ReadRuns(coded.header, coded.payload, kCodedFrame).value();
      ASSERT_EQ(a.rgba.size(), b.rgba.size());
      for (std::size_t k = 0; k < a.rgba.size(); ++k) ASSERT_NEAR(a.rgba[k], b.rgba[k], coding == ColorCoding::kHalf ? 0x1p-11 : 8e-6);
      if (coding == ColorCoding::kHalf && coded.header.pixel_count > 0) {  // a code that is no colour
        coded.payload.back() = std::byte{0x7C};
        EXPECT_EQ(ReadRuns(coded.header, coded.payload, kCodedFrame).status().code(), StatusCode::kInvalidArgument);
      }
    }
  }
  // Where 16-bit codes cannot hold the colours they stay floats.
  LocalImage bright = MakeLocalImage(PixelFormat::kRgba, {0, 0, 4, 1});
  bright.rgba[0] = bright.rgba[3] = 2;
  EXPECT_EQ(EncodeRuns(ViewOf(bright), ColorCoding::kHalf).header.color, ColorCoding::kFloat32);
  const LocalImage depth = RandomImage(random, PixelFormat::kDepth, kCodedFrame);
  EXPECT_EQ(EncodeRuns(ViewOf(depth), ColorCoding::kFixed16).header.color, ColorCoding::kFloat32);
  RunImage wrong = EncodeRuns(ViewOf(depth));
  wrong.header.color = ColorCoding::kHalf;
  EXPECT_FALSE(ReadRuns(wrong.header, wrong.payload, kCodedFrame).ok());
}

TEST(ColorCoding, ImagesWithVoxelsTravelWithColoursOf8Bits) {
  Random random(75);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const LocalImage image = RandomImage(random, PixelFormat::kDepth, RandomBounds(random, kCodedFrame));
    const RunImage coded = EncodeRuns(ViewOf(image), ColorCoding::kStraight8);
    EXPECT_EQ(coded.payload.size(), 12 * (coded.header.run_count + coded.header.pixel_count));
    const LocalImage read = ReadRuns(coded.header, coded.payload, kCodedFrame).value();
    EXPECT_EQ(read.bounds, image.bounds);
    EXPECT_TRUE(std::ranges::equal(read.depth, image.depth));
    std::vector<std::uint8_t> expected(image.rgba.size()), codes(image.rgba.size());
    StraightCodes(image.rgba.data(), expected.size() / 4, expected.data());
    StraightCodes(read.rgba.data(), codes.size() / 4, codes.data());
    for (std::size_t k = 0; k < image.depth.size(); ++k) {
      if (std::isinf(image.depth[k])) continue;
      ASSERT_EQ(read.voxel[k], image.voxel[k]);
      ASSERT_TRUE(std::equal(&codes[4 * k], &codes[4 * k + 4], &expected[4 * k]));
    }
  }
}

}  // namespace
}  // namespace slabstream
