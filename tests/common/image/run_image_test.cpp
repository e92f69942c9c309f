#include "common/image/run_image.h"
#include "common/image/image_view.h"
#include "common/image/sample_codes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "tests/support/random_image.h"
#include "tests/support/same_image.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 23, 17};
constexpr PixelRange kWhole = {0, 23 * 17};
constexpr PixelFormat kFormats[] = {PixelFormat::kRgba, PixelFormat::kDepth, PixelFormat::kRgbaDepth};

std::uint64_t LinearIndex(std::int32_t x, std::int32_t y) { return std::uint64_t(y) * std::uint64_t(kFrame.width()) + std::uint64_t(x); }

// Compares a pixel of two images; outside its bounds an image is empty.
void ExpectSamePixel(const LocalImage& a, const LocalImage& b, std::int32_t x, std::int32_t y) {
  struct Pixel {
    float rgba[4] = {0, 0, 0, 0};
    float depth = std::numeric_limits<float>::infinity();
    std::uint32_t voxel = 0;
  };
  const auto read = [&](const LocalImage& image) {
    Pixel pixel;
    if (!image.bounds.Contains(PixelBounds{x, y, x + 1, y + 1})) return pixel;
    const auto i = std::size_t(y - image.bounds.y_begin) * std::size_t(image.bounds.width()) + std::size_t(x - image.bounds.x_begin);
    std::memcpy(pixel.rgba, &image.rgba[4 * i], sizeof(pixel.rgba));
    if (HasDepth(image.format)) pixel.depth = image.depth[i];
    if (HasVoxel(image.format)) pixel.voxel = image.voxel[i];
    return pixel;
  };
  const Pixel p = read(a), q = read(b);
  EXPECT_EQ(std::memcmp(&p, &q, sizeof(p)), 0) << "at " << x << ", " << y;
}

TEST(RunImage, EncodesExactlyThePixelsOfTheRange) {
  Random random(31);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 400; ++i) {
    const PixelFormat format = kFormats[i % 3];
    const LocalImage image = RandomImage(random, format, RandomBounds(random, kFrame));
    const std::uint64_t begin = random.Integer<std::uint64_t>(0, kWhole.end), end = random.Integer<std::uint64_t>(begin, kWhole.end);
    const PixelRange range = i % 4 < 2 ? kWhole : PixelRange{begin, end};
    const RunImage runs = EncodeRuns(image, range, kFrame.width());
    const Result<LocalImage> read = ReadRuns(runs.header, runs.payload, kFrame);
    ASSERT_EQ(read.status(), Status::Ok());
    const LocalImage& decoded = *read;
    const LocalImage nothing = MakeLocalImage(format, {});
    for (std::int32_t y = 0; y < kFrame.height(); ++y) {
      for (std::int32_t x = 0; x < kFrame.width(); ++x) {
        const bool inside = LinearIndex(x, y) >= range.begin && LinearIndex(x, y) < range.end;
        ExpectSamePixel(decoded, inside ? image : nothing, x, y);
      }
    }
  }
}

TEST(RunImage, LeavesEmptyPixelsAndRowsOut) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, {2, 3, 12, 9});
  image.rgba[4 * (2 * 10 + 4) + 3] = 0.5F;  // (6, 5)
  image.rgba[4 * (2 * 10 + 5) + 3] = 0.5F;  // (7, 5)
  const RunImage runs = EncodeRuns(image, {LinearIndex(0, 4), LinearIndex(0, 7)}, kFrame.width());
  EXPECT_EQ(runs.header.bounds, (PixelBounds{6, 5, 8, 6}));
  EXPECT_EQ(runs.header.run_count, 1U);
  EXPECT_EQ(runs.header.pixel_count, 2U);
  EXPECT_EQ(runs.payload.size(), 12U + 2 * 16U);
  std::uint32_t run[3];
  std::memcpy(run, runs.payload.data(), sizeof(run));
  EXPECT_EQ(run[0], 0U);  // row
  EXPECT_EQ(run[1], 0U);  // column
  EXPECT_EQ(run[2], 2U);  // pixels
}

TEST(RunImage, NothingEncodesToNothing) {
  for (PixelFormat format : kFormats) {
    const RunImage empty = EncodeRuns(MakeLocalImage(format, {}), kWhole, kFrame.width());
    EXPECT_EQ(empty.header, (RunImageHeader{format, {}, 0, 0}));
    EXPECT_TRUE(empty.payload.empty());
    EXPECT_TRUE(ReadRuns(empty.header, empty.payload, kFrame).value().bounds.empty());
    // The range lies above the image.
    const RunImage outside = EncodeRuns(MakeLocalImage(format, {0, 8, 4, 12}), {0, LinearIndex(0, 8)}, kFrame.width());
    EXPECT_EQ(outside.header, empty.header);
  }
}

TEST(RunImage, RangeMayGoBeyondTheFrame) {
  Random random(32);
  SCOPED_TRACE(random.trace());
  const LocalImage image = RandomImage(random, PixelFormat::kRgba, kFrame);
  const RunImage all = EncodeRuns(image, {0, std::numeric_limits<std::uint64_t>::max()}, kFrame.width());
  EXPECT_EQ(all.payload, EncodeRuns(image, kWhole, kFrame.width()).payload);
}

TEST(RunImage, TallImagesAreCutIntoBands) {
  Random random(34);
  SCOPED_TRACE(random.trace());
  constexpr PixelBounds kTall = {0, 0, 40, 150};
  for (const PixelFormat format : kFormats) {
    LocalImage image = RandomImage(random, format, {3, 5, 33, 147});
    // A few rows without a pixel, where a band ends, and some that are full.
    const std::size_t width = 30;
    std::fill_n(image.rgba.begin() + 4 * 30 * width, 4 * 5 * width, 0.0F);
    if (HasDepth(format)) std::fill_n(image.depth.begin() + 30 * width, 5 * width, std::numeric_limits<float>::infinity());
    if (HasVoxel(format)) std::fill_n(image.voxel.begin() + 30 * width, 5 * width, 0U);
    std::fill_n(image.rgba.begin() + 4 * 62 * width, 4 * 3 * width, 1.0F);
    if (HasDepth(format)) std::fill_n(image.depth.begin() + 62 * width, 3 * width, 1.0F);
    const RunImage runs = EncodeRuns(image, {0, 40 * 150}, 40);
    const Result<LocalImage> read = ReadRuns(runs.header, runs.payload, kTall);
    ASSERT_EQ(read.status(), Status::Ok());
    ExpectSameBits(*read, image);
  }
}

TEST(RunImage, PicturesLeaveTheVoxelsOut) {
  Random random(35);
  SCOPED_TRACE(random.trace());
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    const LocalImage image = RandomImage(random, format, {2, 3, 20, 15});
    const RunImage runs = EncodePicture(image);
    const LocalImage decoded = ReadRuns(runs.header, runs.payload, kFrame).value();
    EXPECT_EQ(decoded.format, format == PixelFormat::kRgba ? PixelFormat::kRgba : PixelFormat::kRgbaDepth);
    EXPECT_EQ(decoded.bounds, image.bounds);
    EXPECT_EQ(decoded.rgba, image.rgba);
    EXPECT_EQ(decoded.depth, image.depth);
    EXPECT_TRUE(decoded.voxel.empty());
  }
  EXPECT_EQ(EncodePicture(MakeLocalImage(PixelFormat::kDepth, {})).header.format, PixelFormat::kRgbaDepth);
}

// Runs of a picture in the codes of a PNG of 8 bits: a quarter of the colours' bytes, no depths, and the PNG is the same.
TEST(RunImage, PicturesMayComeInTheCodesOfAFile) {
  Random random(37);
  SCOPED_TRACE(random.trace());
  for (const PixelFormat format : {PixelFormat::kRgba, PixelFormat::kDepth}) {
    const LocalImage image = RandomImage(random, format, {2, 3, 20, 15});
    const RunImage runs = EncodePicture(image, ColorCoding::kStraight8);
    EXPECT_EQ(runs.payload.size(), 12 * runs.header.run_count + 4 * runs.header.pixel_count);
    const LocalImage decoded = ReadRuns(runs.header, runs.payload, kFrame).value();
    EXPECT_EQ(decoded.format, PixelFormat::kRgba);
    ASSERT_EQ(decoded.bounds, image.bounds);
    std::vector<std::uint8_t> codes(image.rgba.size()), decoded_codes(image.rgba.size());
    StraightCodes(image.rgba.data(), codes.size() / 4, codes.data());
    StraightCodes(decoded.rgba.data(), codes.size() / 4, decoded_codes.data());
    EXPECT_EQ(decoded_codes, codes);
  }
}

// The same pixels travel, and the others are what lies behind.
TEST(RunImage, CodesMayBeThoseOverABackground) {
  constexpr Premultiplied kBehind = {0.25F, 1, 0.5F, 1};
  Random random(38);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 20; ++i) {
    LocalImage image = RandomImage(random, PixelFormat::kRgba, {2, 3, 20, 15});
    for (float& value : image.rgba) value = value == 0 ? 0 : random.Real(0.1, 1);
    const RunImage alone = EncodePicture(image, ColorCoding::kStraight8), over = EncodePicture(image, ColorCoding::kStraight8, kBehind);
    EXPECT_EQ(over.header, alone.header);
    StraightImage picture = MakeStraightImage(image.bounds, kBehind);
    ASSERT_EQ(ReadCodesInto(over.header, over.payload, kFrame, picture), Status::Ok());
    std::vector<std::uint8_t> expected(image.rgba.size());
    StraightCodes(image.rgba.data(), expected.size() / 4, expected.data(), kBehind);
    EXPECT_TRUE(std::ranges::equal(picture.codes, expected)) << "image " << i;
  }
}

TEST(RunImage, BoundsOfPicturesEndWhereTheyShowNothing) {
  Random random(36);
  SCOPED_TRACE(random.trace());
  const LocalImage content = RandomImage(random, PixelFormat::kRgba, {7, 4, 18, 13});
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, kFrame);
  const PixelBounds& b = content.bounds;
  for (std::int32_t y = b.y_begin; y < b.y_end; ++y) {
    const std::int64_t from = 4 * std::int64_t{y - b.y_begin} * b.width();
    std::copy_n(content.rgba.begin() + from, 4 * b.width(), image.rgba.begin() + 4 * std::int64_t(LinearIndex(b.x_begin, y)));
  }
  const RunImage whole = EncodePicture(image), alone = EncodePicture(content);
  EXPECT_EQ(whole.header, alone.header);
  EXPECT_EQ(whole.payload, alone.payload);
  EXPECT_EQ(EncodePicture(MakeLocalImage(PixelFormat::kRgba, kFrame)).header.bounds, PixelBounds());
}

// ---- hostile input

struct Corruption {
  const char* what;
  void (*apply)(RunImageHeader&, PooledVector<std::byte>&);
  const char* message;
};

void Poke(PooledVector<std::byte>& payload, std::size_t offset, std::uint32_t value) {
  std::memcpy(&payload[offset], &value, sizeof(value));
}
void PokeFloat(PooledVector<std::byte>& payload, std::size_t offset, float value) { std::memcpy(&payload[offset], &value, sizeof(value)); }

// Two runs of two pixels each: (row 0, columns 1 and 2), (row 0, columns 4 and 5), in bounds of 8 x 2.
RunImage TwoRuns(PixelFormat format) {
  LocalImage image = MakeLocalImage(format, {3, 4, 11, 6});
  for (std::size_t x : {1, 2, 4, 5}) {
    image.rgba[4 * x + 3] = 1;
    if (HasDepth(format)) image.depth[x] = 2;
  }
  return EncodeRuns(ViewOf(image));
}

constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min(), kMax = std::numeric_limits<std::int32_t>::max();
constexpr std::uint32_t kHuge = std::numeric_limits<std::uint32_t>::max();

const Corruption kCorruptions[] = {
    {"format", [](auto& h, auto&) { h.format = PixelFormat{7}; }, "format is 7"},
    {"bounds leave the frame", [](auto& h, auto&) { h.bounds.x_end = 24; }, "do not lie in the frame"},
    {"bounds begin before the frame", [](auto& h, auto&) { h.bounds.y_begin = -1; }, "do not lie in the frame"},
    {"bounds of overflowing size",
     [](auto& h, auto&) {
       h.bounds = {kMin, kMin, kMax, kMax};
     },
     "do not lie in the frame"},
    {"negative bounds",
     [](auto& h, auto&) {
       h.bounds = {kMax, kMax, kMin, kMin};
     },
     "do not lie in the frame"},
    {"empty bounds with pixels", [](auto& h, auto&) { h.bounds = {}; }, "pixel_count"},
    {"more pixels than bounds", [](auto& h, auto&) { h.pixel_count = 17; }, "pixel_count is 17"},
    {"absurd pixel count", [](auto& h, auto&) { h.pixel_count = std::uint64_t{1} << 60; }, "pixel_count"},
    {"more runs than pixels", [](auto& h, auto&) { h.run_count = kHuge; }, "run_count"},
    {"truncated", [](auto&, auto& p) { p.pop_back(); }, "payload has"},
    {"too long", [](auto&, auto& p) { p.emplace_back(); }, "payload has"},
    {"empty payload", [](auto&, auto& p) { p.clear(); }, "payload has"},
    {"empty run", [](auto&, auto& p) { Poke(p, 8, 0); }, "run 0"},
    {"run of huge length", [](auto&, auto& p) { Poke(p, 8, kHuge); }, "run 0"},
    {"run past the row's end", [](auto&, auto& p) { Poke(p, 16, 7); }, "run 1"},
    {"run past the last row", [](auto&, auto& p) { Poke(p, 12, 2); }, "run 1"},
    {"runs touch", [](auto&, auto& p) { Poke(p, 16, 3); }, "touches"},
    {"runs overlap", [](auto&, auto& p) { Poke(p, 16, 2); }, "overlaps"},
    {"runs descend", [](auto&, auto& p) { Poke(p, 0, 1); }, "precedes"},
    {"runs hold fewer pixels", [](auto&, auto& p) { Poke(p, 20, 1); }, "runs hold 3 pixels"},
    {"NaN colour", [](auto&, auto& p) { PokeFloat(p, 24 + 4, std::numeric_limits<float>::quiet_NaN()); }, "not finite"},
    {"infinite alpha", [](auto&, auto& p) { PokeFloat(p, 24 + 16 * 3 + 12, std::numeric_limits<float>::infinity()); }, "not finite"},
};

// Nearly all pixels of `bounds`, the others empty.
LocalImage NearlyFull(Random& random, const PixelBounds& bounds) {
  LocalImage image = MakeLocalImage(PixelFormat::kRgba, bounds);
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = i / 4 % 97 == 5 ? 0.0F : float(float(random.Real(0.1, 1)));
  return image;
}

TEST(DenseImages, AreTheirPixelsAsTheyLie) {
  Random random(35);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    PixelBounds bounds = RandomBounds(random, kFrame);
    if (bounds.empty()) bounds = kFrame;
    LocalImage image = NearlyFull(random, bounds);
    for (std::int64_t pixel = 0; pixel < bounds.pixel_count(); ++pixel) {  // no rim is empty
      const std::int64_t x = pixel % bounds.width();
      if (x == 0 || x == bounds.width() - 1) image.rgba[4 * std::size_t(pixel) + 3] = 1;
    }
    const ImageView view = ViewOf(image, kWhole, kFrame.width());
    const std::optional<RunImageHeader> header = DenseHeader(view);
    if (!header) continue;  // a small image whose few empty pixels are many
    const std::span<const std::byte> payload(reinterpret_cast<const std::byte*>(view.rgba), PayloadBytes(*header));
    EXPECT_EQ(payload.size(), sizeof(float) * image.rgba.size());
    EXPECT_EQ(ReadRuns(*header, payload, kFrame)->rgba, image.rgba);

    std::vector<std::byte> bad(payload.begin(), payload.end());
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(bad.data() + 4 * random.Integer<std::size_t>(0, bad.size() / 4 - 1), &nan, sizeof(nan));
    EXPECT_FALSE(ReadRuns(*header, bad, kFrame).ok());
    RunImageHeader less = *header;
    less.pixel_count -= 1;
    if (less.pixel_count == 0) continue;  // an empty picture is well
    EXPECT_FALSE(ReadRuns(less, payload.first(payload.size() - 16), kFrame).ok());
  }
  EXPECT_TRUE(DenseHeader(ViewOf(NearlyFull(random, kFrame))).has_value());
}

TEST(DenseImages, AreNotThoseWithGapsHolesOrDepths) {
  Random random(36);
  SCOPED_TRACE(random.trace());
  const LocalImage image = NearlyFull(random, kFrame);
  EXPECT_FALSE(DenseHeader(ViewOf(LocalImage{})).has_value());
  EXPECT_FALSE(DenseHeader(ViewOf(RandomImage(random, PixelFormat::kRgba, kFrame))).has_value()) << "a third is empty";
  EXPECT_FALSE(DenseHeader(ViewOf(RandomImage(random, PixelFormat::kDepth, kFrame))).has_value());
  EXPECT_FALSE(DenseHeader(ViewOf(image, {0, 23 * 5 + 7}, kFrame.width())).has_value()) << "the last row is not whole";
  LocalImage spans = image;
  spans.rows.assign(17, {0, 23});
  spans.rows[3] = {0, 22};
  EXPECT_FALSE(DenseHeader(ViewOf(spans)).has_value()) << "what lies beside a span may be anything";
  ImageView left = ViewOf(image);
  left.bounds.x_end = 10;
  for (ColumnSpan& row : left.rows) row.end = 10;
  EXPECT_FALSE(DenseHeader(left).has_value()) << "rows are apart";
}

TEST(ReadRuns, RefusesWhatDoesNotFit) {
  for (PixelFormat format : kFormats) {
    for (const Corruption& corruption : kCorruptions) {
      SCOPED_TRACE(corruption.what);
      RunImage image = TwoRuns(format);
      ASSERT_TRUE(ReadRuns(image.header, image.payload, kFrame).ok());
      corruption.apply(image.header, image.payload);
      const Status status = ReadRuns(image.header, image.payload, kFrame).status();
      EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
      EXPECT_NE(status.message().find(corruption.message), std::string::npos) << status.message();
    }
  }
  RunImage image = TwoRuns(PixelFormat::kDepth);
  PokeFloat(image.payload, 24 + 16 * 4 + 4, std::numeric_limits<float>::quiet_NaN());
  EXPECT_NE(ReadRuns(image.header, image.payload, kFrame).status().message().find("depth"), std::string::npos);
}

TEST(ReadRuns, WhatItAcceptsCanBeEncodedAgain) {
  Random random(33);
  SCOPED_TRACE(random.trace());
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    RunImage image = TwoRuns(kFormats[i % 3]);
    for (int flips = random.Integer(1, 3); flips > 0; --flips) {
      auto& byte = image.payload[random.Integer<std::size_t>(0, image.payload.size() - 1)];
      byte ^= std::byte(1 << random.Integer(0, 7));
    }
    if (random.Chance(0.3)) image.header.bounds.x_begin = random.Integer(-2, 25);
    if (random.Chance(0.3)) image.header.bounds.y_end = random.Integer(-2, 25);
    const Result<LocalImage> read = ReadRuns(image.header, image.payload, kFrame);
    if (!read.ok()) continue;
    ++accepted;
    EXPECT_EQ(read->bounds, image.header.bounds);
    const RunImage again = EncodeRuns(*read, kWhole, kFrame.width());
    EXPECT_EQ(ReadRuns(again.header, again.payload, kFrame).status(), Status::Ok());
    EXPECT_LE(again.header.pixel_count, image.header.pixel_count);
  }
  EXPECT_GT(accepted, 100);  // most bits are those of pixels
}

TEST(ReadCodes, PartsOfAPictureBecomeOne) {
  Random random(34);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    LocalImage image = RandomImage(random, PixelFormat::kRgba, kFrame);
    for (float& value : image.rgba) value = value == 0 ? 0 : random.Real(0.1, 1);
    std::vector<std::uint8_t> expected(image.rgba.size());
    StraightCodes(image.rgba.data(), expected.size() / 4, expected.data());
    StraightImage put_together = MakeStraightImage(kFrame);
    for (PixelRange part = {0, 0}; part.end < kWhole.end;) {
      part = {part.end, std::min(kWhole.end, part.end + random.Integer<std::uint64_t>(1, kWhole.end))};
      const RunImage runs = EncodeRuns(ViewOf(image, part, kFrame.width()), ColorCoding::kStraight8);
      ASSERT_EQ(ReadCodesInto(runs.header, runs.payload, kFrame, put_together), Status::Ok());
    }
    EXPECT_TRUE(std::ranges::equal(put_together.codes, expected)) << "image " << i;
  }
}

TEST(ReadCodes, DamagedRunsAreRefused) {
  Random random(35);
  SCOPED_TRACE(random.trace());
  StraightImage picture = MakeStraightImage(kFrame);
  int refused = 0;
  for (int i = 0; i < 5000; ++i) {
    RunImage image =
        EncodeRuns(ViewOf(RandomImage(random, PixelFormat::kRgba, {2, 3, 9, 8}), kWhole, kFrame.width()), ColorCoding::kStraight8);
    if (image.header.run_count == 0) continue;
    const std::size_t table = 12 * std::size_t{image.header.run_count};
    image.payload[random.Integer<std::size_t>(0, table - 1)] ^= std::byte(1 << random.Integer(0, 7));
    if (random.Chance(0.2)) image.payload.resize(image.payload.size() - 1);
    refused += ReadCodesInto(image.header, image.payload, kFrame, picture).ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 2000);
}

TEST(ReadRuns, ReadsPayloadsAtAnyAddress) {
  const RunImage image = TwoRuns(PixelFormat::kDepth);
  std::vector<std::byte> shifted(image.payload.size() + 1);
  std::memcpy(shifted.data() + 1, image.payload.data(), image.payload.size());
  const auto payload = std::span<const std::byte>(shifted).subspan(1);
  EXPECT_EQ(ReadRuns(image.header, payload, kFrame).value().rgba, ReadRuns(image.header, image.payload, kFrame).value().rgba);
}

}  // namespace
}  // namespace slabstream
