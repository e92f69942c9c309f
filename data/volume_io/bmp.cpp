// A folder of numbered BMP pictures, one a slice, as scanners of micro-CT write them: uncompressed, 1, 4, 8, 24 or 32 bits a pixel.
// Palettes of greys give grey values, others red, green and blue. The format is that of Windows: BITMAPFILEHEADER, then a header that says
// its size.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "data/volume_io/binary_header.h"
#include "data/volume_io/slice_stack.h"

namespace slabstream {
namespace {

class BmpFile : public SliceFile {
 public:
  static constexpr std::string_view kFormat = "BMP";

  explicit BmpFile(std::string path) : path_(std::move(path)), file_(path_, std::ios::binary) {}

  Status Open() {
    if (!file_) return Status::NotFound(path_ + ": cannot be opened for reading");
    std::array<std::byte, 54> bytes{};  // of both headers
    const bool whole = bool(file_.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size())));
    const BinaryHeader header(bytes, false);
    const auto header_bytes = header.At<std::uint32_t>(14);
    if (!whole || header.At<std::uint16_t>(0) != 0x4d42 || header_bytes < 40 || header_bytes > 1024) return Refused("not a BMP picture");
    samples_begin_ = header.At<std::uint32_t>(10);
    width_ = header.At<std::int32_t>(18);
    height_ = header.At<std::int32_t>(22);
    bits_ = header.At<std::uint16_t>(28);
    const auto compression = header.At<std::uint32_t>(30), colours = header.At<std::uint32_t>(46);
    constexpr std::uint32_t kNone = 0, kMasks = 3;
    const bool plain = compression == kNone && (bits_ == 1 || bits_ == 4 || bits_ == 8 || bits_ == 24 || bits_ == 32);
    if (!plain && !(compression == kMasks && bits_ == 32)) {
      return Refused(
          fmt::format("{} bits a pixel with compression {} are not supported, 1, 4, 8, 24 and 32 without one are", bits_, compression));
    }
    if (bits_ > 8) return compression == kMasks ? CheckMasks() : Status::Ok();
    return ReadPalette(14 + header_bytes, colours == 0 ? 1U << bits_ : colours);
  }

  Result<RawHeader> ReadHeader() override {
    RawHeader header{.components = grey_ ? 1 : 3, .type = SampleType::kUint8};
    if (Status status = SetSize(header, path_, {double(width_), std::abs(double(height_)), 1}, {}); !status.ok()) return status;
    return header;
  }

  Status ReadSamples(const RawHeader& header, std::byte* out) override {
    const auto width = std::size_t(header.size.x), out_row = width * std::size_t(header.components);
    std::vector<std::uint8_t> row((width * bits_ + 31) / 32 * 4);
    file_.seekg(std::streamoff(samples_begin_));
    for (std::int32_t y = 0; y < header.size.y; ++y) {
      if (!file_.read(reinterpret_cast<char*>(row.data()), std::streamsize(row.size()))) {
        return Status::DataLoss(path_ + ": truncated or damaged");
      }
      // Rows begin at the bottom unless the height is negative.
      auto* to = reinterpret_cast<std::uint8_t*>(out) + std::size_t(height_ < 0 ? y : header.size.y - 1 - y) * out_row;
      for (std::size_t x = 0; x < width; ++x, to += header.components) {
        const std::uint8_t* const blue = bits_ > 8 ? &row[x * bits_ / 8] : palette_[IndexAt(row, x)].data();
        for (int c = 0; c < header.components; ++c) to[c] = blue[2 - c];
      }
    }
    return Status::Ok();
  }

 private:
  using Colour = std::array<std::uint8_t, 4>;  // blue, green, red, nothing

  Status Refused(const std::string& why) const { return Status::InvalidArgument(path_ + ": " + why); }

  std::size_t IndexAt(const std::vector<std::uint8_t>& row, std::size_t x) const {
    const std::size_t in_byte = 8 / bits_;
    return row[x / in_byte] >> (8 - bits_ - bits_ * (x % in_byte)) & ((1U << bits_) - 1);
  }

  // Entries that a short palette lacks are black.
  Status ReadPalette(std::uint32_t begin, std::uint32_t colours) {
    if (colours > palette_.size()) return Refused(fmt::format("a palette of {} colours, must have at most 256", colours));
    file_.seekg(begin);
    const bool whole = bool(file_.read(reinterpret_cast<char*>(palette_.data()), std::streamsize(colours * sizeof(Colour))));
    if (!whole) return Status::DataLoss(path_ + ": truncated or damaged");
    grey_ = std::ranges::all_of(palette_, [](const Colour& colour) { return colour[0] == colour[1] && colour[1] == colour[2]; });
    return Status::Ok();
  }

  // Behind the first 40 bytes of the header.
  Status CheckMasks() {
    std::array<std::uint32_t, 3> masks{};
    const bool whole = bool(file_.read(reinterpret_cast<char*>(masks.data()), sizeof(masks)));
    if (whole && masks == std::array<std::uint32_t, 3>{0xff0000, 0xff00, 0xff}) return Status::Ok();
    return Refused("its masks of red, green and blue are not supported");
  }

  const std::string path_;
  std::ifstream file_;
  std::uint32_t samples_begin_ = 0;  // in the file
  std::int32_t width_ = 0, height_ = 0;
  unsigned bits_ = 0;  // of a pixel
  bool grey_ = false;
  std::array<Colour, 256> palette_{};
};

}  // namespace

VolumeFormat Bmp() { return StackFormat<BmpFile>(); }

}  // namespace slabstream
