// Run images: both readers of their payload, the one that makes an image of it and the one that combines it straight from the message.
//
// input: u8 format, u8 colour coding, 4 x u8 bounds, u16 run count, u16 pixel count, payload
#include <algorithm>
#include <array>
#include <limits>

#include "common/image/image_view.h"
#include "common/kernels/combine.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/random_image.h"

namespace slabstream {
namespace {

constexpr PixelBounds kFrame = {0, 0, 48, 32};

template <class T>
bool SameBytes(const T& a, const T& b) {
  return std::ranges::equal(std::as_bytes(std::span(a)), std::as_bytes(std::span(b)));
}

RunImage Encoded(const LocalImage& image) { return EncodeRuns(image, {0, std::uint64_t(kFrame.pixel_count())}, kFrame.width()); }

// The pixels that a renderer or a sender may have, so that they combine: premultiplied colours of pixels that are not empty.
void CheckCombining(const RunImageHeader& header, std::span<const std::byte> payload, const LocalImage& image) {
  if (header.format == PixelFormat::kRgbaDepth) return;  // of finished pictures, which do not combine
  for (const Side side : {Side::kFront, Side::kBack}) {
    LocalImage combined = MakeLocalImage(header.format, {});
    if (const Status status = CombineRuns(combined, header, payload, kFrame, side, kFrame); !status.ok()) CheckRefusal(status);
    LocalImage over_itself = image;
    if (const Status status = CombineRuns(over_itself, header, payload, kFrame, side, kFrame); !status.ok()) CheckRefusal(status);
  }
}

FuzzBytes Seed(const RunImage& image) {
  const PixelBounds& b = image.header.bounds;
  FuzzSeed seed;
  seed.Put(std::uint8_t(image.header.format)).Put(std::uint8_t(image.header.color));
  for (const std::int32_t side : {b.x_begin, b.y_begin, b.x_end, b.y_end}) seed.Put(std::uint8_t(side));
  seed.Put(std::uint16_t(image.header.run_count)).Put(std::uint16_t(image.header.pixel_count));
  return seed.Put(image.payload).bytes();
}

}  // namespace

bool DecodeRunImage(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  RunImageHeader header;
  header.format = PixelFormat(input.Take<std::uint8_t>());
  header.color = ColorCoding(input.Take<std::uint8_t>());
  for (std::int32_t* side : {&header.bounds.x_begin, &header.bounds.y_begin, &header.bounds.x_end, &header.bounds.y_end})
    *side = std::int8_t(input.Take<std::uint8_t>());
  header.run_count = input.Take<std::uint16_t>();
  header.pixel_count = input.Take<std::uint16_t>();

  const Result<LocalImage> image = ReadRuns(header, input.rest(), kFrame);
  const Status table = ValidateRunTable(header, input.rest(), kFrame);
  if (!image.ok()) {
    CheckRefusal(image.status());
    // Whoever combines messages as they are meets the same: an error, and no pixel from outside of the payload.
    if (table.ok()) CheckCombining(header, input.rest(), MakeLocalImage(header.format, {}));
    return false;
  }
  CHECK(table.ok()) << table.message();
  CHECK(kFrame.Contains(image->bounds));
  CHECK_EQ(image->rgba.size(), 4 * std::size_t(header.bounds.pixel_count()));
  CheckCombining(header, input.rest(), *image);

  // Runs may hold empty pixels, and colours that only a sender can have; what comes back from there is stable.
  const RunImage once = Encoded(*image);
  const Result<LocalImage> read = ReadRuns(once.header, once.payload, kFrame);
  CHECK(read.ok()) << read.status().message();
  const RunImage twice = Encoded(*read);
  CHECK(twice.header == once.header);
  CHECK(SameBytes(twice.payload, once.payload));
  return true;
}

std::vector<FuzzBytes> RunImageSeeds() {
  Random random(42);
  std::vector<FuzzBytes> seeds;
  for (const PixelFormat format :
       {PixelFormat::kRgba, PixelFormat::kDepth, PixelFormat::kRgbaDepth, PixelFormat::kMaximum, PixelFormat::kSum}) {
    for (const PixelBounds& bounds : {PixelBounds{}, PixelBounds{3, 5, 4, 6}, PixelBounds{0, 0, 12, 7}, PixelBounds{40, 20, 48, 32}}) {
      const LocalImage image = RandomImage(random, format, bounds);
      seeds.push_back(Seed(Encoded(image)));
      for (const ColorCoding color : {ColorCoding::kHalf, ColorCoding::kFixed16, ColorCoding::kStraight8}) {
        if (MayCode(format, color)) seeds.push_back(Seed(EncodeRuns(ViewOf(image), color)));
      }
    }
  }
  // All pixels, without runs.
  const PixelBounds whole = {2, 2, 6, 5};
  FuzzBytes pixels(std::size_t(whole.pixel_count()) * 4 * sizeof(float));
  seeds.push_back(Seed({{PixelFormat::kRgba, whole, 0, std::uint64_t(whole.pixel_count())}, {pixels.begin(), pixels.end()}}));
  return seeds;
}

}  // namespace slabstream
