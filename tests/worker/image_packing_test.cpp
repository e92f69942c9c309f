// When images are packed, and that what is packed comes out again.
#include "worker/service/image_packing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/image/image_view.h"
#include "common/wire/payload.h"
#include "tests/support/random_image.h"

namespace slabstream {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(PackingPays, WhereTheWholeWayIsShorter) {
  Random random(62);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 10000; ++i) {
    const double link = std::pow(10.0, random.Real(5, 10));
    const CodecSpeed codec = {std::pow(10.0, random.Real(7, 10)), random.Real(0, 1)};
    const double as_it_is = 1 / link, packed = 1 / codec.bytes_per_second + codec.ratio / link;
    if (std::abs(as_it_is - packed) < 1e-6 * as_it_is) continue;
    EXPECT_EQ(PackingPays(link, codec), packed < as_it_is) << link << ", " << codec.bytes_per_second << ", " << codec.ratio;
  }
}

TEST(PackingPays, AtItsLimits) {
  const CodecSpeed codec = {4e8, 0.5};
  EXPECT_TRUE(PackingPays(12.5e6, codec));   // 100 Mbit/s
  EXPECT_TRUE(PackingPays(125e6, codec));    // 1 Gbit/s
  EXPECT_FALSE(PackingPays(1.25e9, codec));  // 10 Gbit/s
  EXPECT_FALSE(PackingPays(kInfinite, codec));
  EXPECT_TRUE(PackingPays(0, codec));
  EXPECT_FALSE(PackingPays(0, {4e8, 1}));  // nothing gained
  EXPECT_FALSE(PackingPays(12.5e6, CodecSpeed{}));
}

TEST(ParseCompression, KnowsItsWords) {
  EXPECT_EQ(ParseCompression("auto"), LinkCompression::kAuto);
  EXPECT_EQ(ParseCompression("on"), LinkCompression::kOn);
  EXPECT_EQ(ParseCompression("off"), LinkCompression::kOff);
  for (const char* text : {"", "On", "auto ", "zstd", "1"}) EXPECT_EQ(ParseCompression(text), std::nullopt) << text;
}

TEST(PackForLink, ImagesComeOutAsTheyWentIn) {
  Random random(63);
  SCOPED_TRACE(random.trace());
  constexpr PixelBounds kFrame = {0, 0, 97, 61};
  int packed_ones = 0;
  for (int i = 0; i < 300; ++i) {
    const PixelFormat format = i % 2 == 0 ? PixelFormat::kRgba : PixelFormat::kDepth;
    LocalImage image = RandomImage(random, format, RandomBounds(random, kFrame));
    if (i % 3 == 0) {  // flat colours pack well
      for (std::size_t pixel = 0; pixel < image.rgba.size() / 4; ++pixel) {
        if (image.rgba[4 * pixel + 3] != 0) std::fill_n(&image.rgba[4 * pixel], 4, 0.5F);
      }
    }
    const ColorCoding color = format == PixelFormat::kDepth ? ColorCoding::kFloat32 : ColorCoding(1 + i / 2 % 3);
    const RunImage runs = EncodeRuns(ViewOf(image), color);
    const Bytes raw(runs.payload);
    for (const double link : {0.0, 1e6, 1e8, kInfinite}) {
      Rare<PackedRuns> packed;
      const Bytes payload = PackForLink(raw, link, packed);
      EXPECT_FALSE(packed.has_value() && link == kInfinite);
      if (!packed) {
        EXPECT_EQ(payload.span().data(), raw.span().data());
        continue;
      }
      ++packed_ones;
      EXPECT_EQ(packed->bytes, payload.size());
      EXPECT_LT(payload.size(), raw.size());
      const Result<Bytes> unpacked = UnpackRuns(*packed, payload, PayloadBytes(runs.header));
      ASSERT_TRUE(unpacked.ok()) << unpacked.status().message();
      EXPECT_TRUE(std::ranges::equal(unpacked->span(), raw.span()));
    }
  }
  EXPECT_GT(packed_ones, 100);
}

TEST(PackForLink, DamageIsFound) {
  Random random(64);
  SCOPED_TRACE(random.trace());
  LocalImage image = RandomImage(random, PixelFormat::kRgba, {0, 0, 40, 30});
  const RunImage runs = EncodeRuns(ViewOf(image), ColorCoding::kFixed16);
  Rare<PackedRuns> packed;
  const Bytes payload = PackForLink(Bytes(runs.payload), 0, packed);
  ASSERT_TRUE(packed.has_value());
  const std::size_t raw = PayloadBytes(runs.header);
  const auto fails = [&](const PackedRuns& how, std::vector<std::byte> bytes, std::size_t size) {
    return UnpackRuns(how, Bytes(std::move(bytes)), size).status().code() == StatusCode::kDataLoss;
  };
  const std::vector<std::byte> good(payload.span().begin(), payload.span().end());
  for (int i = 0; i < 300; ++i) {
    std::vector<std::byte> bad = good;
    bad[random.Integer<std::size_t>(0, bad.size() - 1)] ^= std::byte(random.Integer(1, 255));
    EXPECT_TRUE(fails(*packed, bad, raw));
    bad = good;
    bad.resize(random.Integer<std::size_t>(0, bad.size() - 1));
    EXPECT_TRUE(fails(*packed, bad, raw));
  }
  // A frame that is well, of another image.
  EXPECT_TRUE(fails(*packed, good, raw - 4));
  EXPECT_TRUE(fails(*packed, good, std::size_t{1} << 40)) << "no memory is taken for it";
}

}  // namespace
}  // namespace slabstream
