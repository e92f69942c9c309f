#include "client/picture_codec/picture_codec.h"

#include <algorithm>
#include <cstdint>
#include <new>
#include <utility>

#include "client/picture_encoder/picture_encoder.h"
#include "common/base/check.h"
#include "common/image/sample_codes.h"

namespace slabstream {
namespace {

// nullopt: `rows` gave up.
std::optional<std::vector<std::byte>> EncodeRows(const EncodedFormat& format, const PictureEncoder::Rows& rows) {
  std::vector<std::byte> bytes;
  const auto write = [&bytes](std::int64_t offset, std::span<const std::byte> more) {
    bytes.resize(std::max(bytes.size(), std::size_t(offset) + more.size()));
    std::ranges::copy(more, bytes.begin() + offset);
    return true;
  };
  if (OwnPictureEncoder(format.type)->Encode(format, rows, write)) return std::nullopt;
  return bytes;
}

}  // namespace

std::vector<std::byte> EncodeJpeg(const ComposedPicture& picture, const PixelBounds& bounds, int quality) {
  const EncodedFormat format{.type = PictureFileType::kJpeg, .width = bounds.width(), .height = bounds.height(), .quality = quality};
  auto bytes = EncodeRows(format, [&](const PictureEncoder::WriteRow& write) {
    std::vector<float> rgba(4 * std::size_t(picture.size().width));
    std::vector<std::uint8_t> codes(4 * std::size_t(bounds.width()));
    const std::size_t first = 4 * std::size_t(bounds.x_begin);
    for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
      picture.Row(y, rgba, {});
      SampleCodes(rgba.data() + first, codes.size(), codes.data());
      if (!write(y - bounds.y_begin, codes.data())) return false;
    }
    return true;
  });
  CHECK(bytes);  // memory takes all bytes
  return *std::move(bytes);
}

std::optional<std::vector<std::byte>> EncodePng(const ComposedPicture& picture, const PixelBounds& bounds,
                                                const std::atomic<bool>& given_up) {
  const EncodedFormat format{.type = PictureFileType::kPng, .width = bounds.width(), .height = bounds.height()};
  return EncodeRows(format, [&](const PictureEncoder::WriteRow& write) {
    std::vector<std::uint8_t> codes(4 * std::size_t(picture.size().width));
    for (int y = bounds.y_begin; y < bounds.y_end; ++y) {
      if (given_up.load(std::memory_order_relaxed)) return false;
      picture.StraightRow(y, codes);
      if (!write(y - bounds.y_begin, codes.data() + 4 * std::size_t(bounds.x_begin))) return false;
    }
    return true;
  });
}

}  // namespace slabstream
