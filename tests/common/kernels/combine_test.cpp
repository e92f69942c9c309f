#include "common/kernels/combine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/random_image.h"
#include "tests/support/same_image.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 37, 13};
constexpr PixelRange kWhole = {0, 37 * 13};

LocalImage Combined(LocalImage image, const LocalImage& other, Side side) {
  Combine(image, other, side);
  return image;
}

// Either the least or the most that an image may grow to: no difference in the picture.
PixelBounds Room(const PixelBounds& a, const PixelBounds& b, Side side) { return side == Side::kFront ? Union(a, b) : kFrame; }

// The same, with `other` as it travels, at an address where kernels can read it and at one where they cannot.
LocalImage CombinedRuns(const LocalImage& image, const LocalImage& other, Side side) {
  const RunImage runs = EncodeRuns(other, kWhole, kFrame.width());
  LocalImage results[2] = {image, image};
  for (const std::size_t shift : {std::size_t{0}, std::size_t{1}}) {
    std::vector<std::byte> payload(runs.payload.size() + shift);
    std::copy(runs.payload.begin(), runs.payload.end(), payload.begin() + std::ptrdiff_t(shift));
    const auto bytes = std::span<const std::byte>(payload).subspan(shift);
    const PixelBounds room = Room(image.bounds, runs.header.bounds, side);
    EXPECT_EQ(CombineRuns(results[shift], runs.header, bytes, kFrame, side, room), Status::Ok());
  }
  FillRows(results[0]);
  FillRows(results[1]);
  ExpectSameBits(results[0], results[1]);
  return results[0];
}

// The same pixels on the whole frame: images without empty rims have smaller bounds.
LocalImage OnFrame(LocalImage image) {
  FillRows(image);
  LocalImage whole = MakeLocalImage(image.format, kFrame);
  for (std::int32_t y = image.bounds.y_begin; y < image.bounds.y_end; ++y) {
    for (std::int32_t x = image.bounds.x_begin; x < image.bounds.x_end; ++x) {
      const auto from = std::size_t((y - image.bounds.y_begin) * image.bounds.width() + x - image.bounds.x_begin);
      const auto to = std::size_t(y * kFrame.width() + x);
      std::copy_n(&image.rgba[4 * from], 4, &whole.rgba[4 * to]);
      if (image.format != PixelFormat::kDepth) continue;
      whole.depth[to] = image.depth[from];
      whole.voxel[to] = image.voxel[from];
    }
  }
  return whole;
}

PixelRange RandomRange(Random& random) {
  const auto begin = random.Integer<std::uint64_t>(0, kWhole.end);
  return random.Chance(0.2) ? kWhole : PixelRange{begin, random.Integer<std::uint64_t>(begin, kWhole.end)};
}

// `image` without the pixels outside of `range`, if `inside`, or else without those in it.
LocalImage Masked(LocalImage image, PixelRange range, bool inside) {
  image = OnFrame(image);
  for (std::uint64_t i = 0; i < kWhole.end; ++i) {
    if ((i >= range.begin && i < range.end) != inside) MakeEmpty(image, std::size_t(i), std::size_t(i + 1));
  }
  return image;
}

class CombineFormats : public testing::TestWithParam<PixelFormat> {};
INSTANTIATE_TEST_SUITE_P(All, CombineFormats, testing::Values(PixelFormat::kRgba, PixelFormat::kDepth),
                         [](const auto& format) { return format.param == PixelFormat::kRgba ? "Rgba" : "Depth"; });

TEST_P(CombineFormats, OrderOfOperandsDoesNotMatter) {
  Random random(51);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const LocalImage front = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const LocalImage back = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const LocalImage dense = Combined(front, back, Side::kBack);
    ExpectSameBits(dense, Combined(back, front, Side::kFront));
    EXPECT_EQ(dense.bounds, Union(front.bounds, back.bounds));
  }
}

TEST_P(CombineFormats, RunsGiveTheBitsOfDenseImages) {
  Random random(52);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const LocalImage a = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const LocalImage b = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    for (Side side : {Side::kFront, Side::kBack}) {
      const LocalImage dense = Combined(a, b, side), runs = CombinedRuns(a, b, side);
      ExpectSameBits(OnFrame(runs), OnFrame(dense));
    }
  }
}

TEST_P(CombineFormats, ViewsOfARangeGiveTheBitsOfItsPixels) {
  Random random(54);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 500; ++i) {
    const LocalImage a = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const LocalImage b = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const PixelRange range = RandomRange(random);
    const ImageView view = ViewOf(b, range, kFrame.width());
    ASSERT_TRUE(kFrame.Contains(view.bounds));
    const LocalImage part = Masked(b, range, true);
    ExpectSameBits(OnFrame(CopyOf(view)), part);
    ImageView clipped = ViewOf(b);
    Clip(clipped, range, kFrame.width());
    ExpectSameBits(OnFrame(CopyOf(clipped)), part);
    for (Side side : {Side::kFront, Side::kBack}) {
      LocalImage image = a;
      Combine(image, view, side, Room(image.bounds, view.bounds, side));
      ExpectSameBits(OnFrame(image), OnFrame(Combined(a, part, side)));
    }
    LocalImage erased = a;
    Erase(erased, range, kFrame.width());
    ExpectSameBits(OnFrame(erased), Masked(a, range, false));
    Combine(erased, view, Side::kBack, kFrame);
    ExpectSameBits(OnFrame(erased), Combined(Masked(a, range, false), part, Side::kBack));
  }
}

// Bad pixels anywhere: either the result has none of them (another pixel hid it), or it is refused.
TEST_P(CombineFormats, PixelsThatAreNoneNeverPass) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  Random random(55);
  SCOPED_TRACE(random.trace());
  const auto is_good = [](const LocalImage& image) {
    return std::ranges::all_of(image.rgba, [](float c) { return std::isfinite(c); }) &&
           std::ranges::all_of(image.depth, [](float d) { return !std::isnan(d) && d != -kInfinity; });
  };
  int refused = 0, hidden = 0;
  for (int i = 0; i < 2000; ++i) {
    const LocalImage a = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    LocalImage b = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    if (b.bounds.empty()) continue;
    const auto pixel = random.Integer<std::size_t>(0, std::size_t(b.bounds.pixel_count()) - 1);
    const bool spoilt = random.Chance(0.8);
    if (spoilt) {
      const float bad = random.Chance(0.4) ? kNan : random.Chance(0.5) ? kInfinity : -kInfinity;
      if (GetParam() == PixelFormat::kDepth && random.Chance(0.4)) {
        b.depth[pixel] = bad == kInfinity ? kNan : bad;
      } else {
        b.rgba[4 * pixel + random.Integer<std::size_t>(0, 3)] = bad;
      }
    }
    const ImageView view = ViewOf(b);
    const Side side = random.Chance(0.5) ? Side::kFront : Side::kBack;
    LocalImage image = a, same = a;
    const bool accepted = CombineUnchecked(image, view, side, Room(image.bounds, view.bounds, side));
    if (!spoilt) {
      EXPECT_TRUE(accepted);
    }
    if (!accepted) {
      ++refused;
      continue;
    }
    Combine(same, view, side, Room(same.bounds, view.bounds, side));
    ExpectSameBits(OnFrame(image), OnFrame(same));
    EXPECT_TRUE(is_good(OnFrame(image)));
    if (spoilt) ++hidden;
  }
  EXPECT_GT(refused, 500);
  if (GetParam() == PixelFormat::kRgba) {
    EXPECT_EQ(hidden, 0) << "over lets everything through";
  }
}

TEST_P(CombineFormats, EmptyImagesAreNeutral) {
  Random random(53);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    const LocalImage image = RandomImage(random, GetParam(), RandomBounds(random, kFrame));
    const LocalImage transparent = MakeLocalImage(GetParam(), image.bounds);
    for (Side side : {Side::kFront, Side::kBack}) {
      ExpectSameBits(Combined(image, transparent, side), image);
      ExpectSameBits(Combined(transparent, image, side), image);
    }
    if (image.bounds.empty()) continue;
    // A box beside the picture may have rows without a pixel.
    const std::int32_t right = kFrame.x_end, below = kFrame.y_end;
    for (const PixelBounds& none : {PixelBounds{}, PixelBounds{right, 0, right, below}, PixelBounds{0, below, right, below}}) {
      const LocalImage nothing = MakeLocalImage(GetParam(), none);
      for (Side side : {Side::kFront, Side::kBack}) {
        ExpectSameBits(Combined(image, nothing, side), image);
        ExpectSameBits(Combined(nothing, image, side), image);
      }
    }
  }
}

TEST_P(CombineFormats, IsAssociativeUpToRounding) {
  Random random(54);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const LocalImage a = RandomImage(random, GetParam(), kFrame), b = RandomImage(random, GetParam(), kFrame),
                     c = RandomImage(random, GetParam(), kFrame);
    const LocalImage left = Combined(Combined(a, b, Side::kBack), c, Side::kBack);
    const LocalImage right = Combined(a, Combined(b, c, Side::kBack), Side::kBack);
    if (GetParam() == PixelFormat::kDepth) {
      ExpectSameBits(left, right);
    } else {
      for (std::size_t k = 0; k < left.rgba.size(); ++k)
        ASSERT_NEAR(left.rgba[k], right.rgba[k], 3e-7F);  // a few roundings of numbers up to 1
    }
  }
}

TEST(Combine, OpaqueHidesAndOverDoesNotCommute) {
  const auto one_pixel = [](float r, float alpha) {
    LocalImage image = MakeLocalImage(PixelFormat::kRgba, {0, 0, 1, 1});
    image.rgba = {r, 0, 0, alpha};
    return image;
  };
  const LocalImage opaque = one_pixel(0.75F, 1), half = one_pixel(0.25F, 0.5F);
  ExpectSameBits(Combined(opaque, half, Side::kBack), opaque);
  EXPECT_EQ(Combined(half, opaque, Side::kBack).rgba, (PooledVector<float>{0.625F, 0, 0, 1}));  // by hand: 0.25 + 0.5 * 0.75
}

TEST(Combine, DepthTiesGoToTheLowerVoxelAcrossTheWrap) {
  EXPECT_TRUE(NearerDepth(1, 9, 2, 3));
  EXPECT_TRUE(NearerDepth(1, 3, 1, 9));
  EXPECT_FALSE(NearerDepth(1, 9, 1, 3));
  EXPECT_TRUE(NearerDepth(1, 0xFFFFFFFFU, 1, 0));  // neighbours on both sides of 2^32
  EXPECT_FALSE(NearerDepth(1, 0, 1, 0xFFFFFFFFU));
  EXPECT_FALSE(NearerDepth(1, 7, 1, 7));
}

TEST(CombineRuns, DenseImagesCombineAsTheirRuns) {
  Random random(37);
  SCOPED_TRACE(random.trace());
  for (const Side side : {Side::kFront, Side::kBack}) {
    const LocalImage image = RandomImage(random, PixelFormat::kRgba, RandomBounds(random, kFrame));
    LocalImage other = RandomImage(random, PixelFormat::kRgba, {3, 2, 30, 11});
    for (float& value : other.rgba) value = value == 0 ? 0.25F : value;
    const std::optional<RunImageHeader> header = DenseHeader(ViewOf(other));
    ASSERT_TRUE(header.has_value());
    LocalImage combined = image;
    const std::span<const std::byte> payload = std::as_bytes(std::span(other.rgba));
    ASSERT_EQ(CombineRuns(combined, *header, payload, kFrame, side, kFrame), Status::Ok());
    ExpectSameBits(OnFrame(combined), OnFrame(Combined(image, other, side)));
  }
}

}  // namespace
}  // namespace slabstream
