#include "client/pictures/picture_header.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "client/pictures/picture_writer.h"
#include "common/base/printable.h"

namespace slabstream {
namespace {

// Takes values from the beginning of some bytes. Once they do not suffice, all values are zero or empty, and ok() is false.
class HeaderBytes {
 public:
  explicit HeaderBytes(std::string_view bytes) : rest_(bytes) {}

  bool ok() const { return ok_; }
  bool empty() const { return rest_.empty(); }

  std::string_view Take(std::size_t count) {
    ok_ = ok_ && count <= rest_.size();
    if (!ok_) return {};
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  std::uint32_t BigEndian() {
    std::uint32_t value = 0;
    for (const char c : Take(4)) value = value << 8U | static_cast<unsigned char>(c);
    return value;
  }
  std::uint32_t LittleEndian() {
    const std::uint32_t value = BigEndian();
    return value << 24U | (value << 8U & 0xFF0000U) | (value >> 8U & 0xFF00U) | value >> 24U;
  }
  // Up to a zero, which is taken too.
  std::string_view Text() {
    const std::string_view text = rest_.substr(0, rest_.find('\0'));
    Take(text.size() + 1);
    return ok_ ? text : std::string_view();
  }

 private:
  std::string_view rest_;
  bool ok_ = true;
};

constexpr std::string_view kPngSignature("\x89PNG\r\n\x1a\n", 8);
constexpr std::string_view kExrSignature("\x76\x2f\x31\x01", 4);

Status Damaged(std::string_view what) { return Status::InvalidArgument(fmt::format("is damaged: {}", what)); }

struct ColorType {
  unsigned number;
  std::vector<std::string> channels;
  unsigned bits;  // a set of depths
};

Status ReadPngSize(HeaderBytes chunk, PictureHeader& header) {
  static const std::array<ColorType, 5> kColorTypes = {{{0, {"gray"}, 1 | 2 | 4 | 8 | 16},
                                                        {2, {"R", "G", "B"}, 8 | 16},
                                                        {3, {"palette"}, 1 | 2 | 4 | 8},
                                                        {4, {"gray", "A"}, 8 | 16},
                                                        {6, {"R", "G", "B", "A"}, 8 | 16}}};
  constexpr std::uint32_t kMostPixels = 0x7FFFFFFF;
  header.width = chunk.BigEndian();
  header.height = chunk.BigEndian();
  const std::string_view kind = chunk.Take(2);
  if (!chunk.ok()) return Damaged("its header chunk is too short");
  for (const std::uint32_t side : {header.width, header.height}) {
    if (side == 0 || side > kMostPixels) return Damaged(fmt::format("a side of {} pixels", side));
  }
  const auto bits = static_cast<unsigned char>(kind[0]), number = static_cast<unsigned char>(kind[1]);
  const auto found = std::ranges::find(kColorTypes, unsigned{number}, &ColorType::number);
  if (found == kColorTypes.end() || !std::has_single_bit(unsigned{bits}) || (found->bits & bits) == 0) {
    return Damaged(fmt::format("colour type {} with {} bits", number, bits));
  }
  header.channels = found->channels;
  header.sample_type = fmt::format("uint{}", bits);
  return Status::Ok();
}

void ReadPngDensity(HeaderBytes chunk, PictureHeader& header) {
  const std::uint32_t x = chunk.BigEndian(), y = chunk.BigEndian();
  const std::string_view unit = chunk.Take(1);
  if (chunk.ok() && unit[0] == 1 && x > 0 && x == y) header.pixel_mm = 1000.0 / x;
}

// A file is a signature and chunks: length, type, data, checksum of type and data. What comes with the pixels or after them is not read.
Status ReadPng(HeaderBytes file, PictureHeader& header) {
  header.format = "PNG";
  for (bool first = true;; first = false) {
    const std::uint32_t length = file.BigEndian();
    const std::string_view type_and_data = file.Take(std::size_t{4} + length);
    const std::uint32_t checksum = file.BigEndian();
    if (!file.ok()) return Damaged("it ends within its header");
    const std::string_view type = type_and_data.substr(0, 4), data = type_and_data.substr(4);
    if (first != (type == "IHDR")) return Damaged("it does not begin with one header chunk");
    if (type == "IDAT" || type == "IEND") return Status::Ok();
    if (type != "IHDR" && type != "pHYs" && type != "tEXt") continue;
    if (::crc32_z(0, reinterpret_cast<const Bytef*>(type_and_data.data()), type_and_data.size()) != checksum) {
      return Damaged(fmt::format("the checksum of chunk {} does not hold", type));
    }
    if (type == "IHDR") {
      if (Status status = ReadPngSize(HeaderBytes(data), header); !status.ok()) return status;
    } else if (type == "pHYs") {
      ReadPngDensity(HeaderBytes(data), header);
    } else if (data.starts_with(std::string_view(kRecordName, sizeof kRecordName))) {  // and the zero after it
      header.record = data.substr(sizeof kRecordName);
    }
  }
}

Status ReadExrChannels(HeaderBytes list, PictureHeader& header) {
  static constexpr std::array<std::string_view, 3> kTypes = {"uint32", "half", "float"};
  for (std::string_view name = list.Text(); !name.empty(); name = list.Text()) {
    const std::uint32_t type = list.LittleEndian();
    list.Take(12);  // compression and sampling
    if (!list.ok() || type >= kTypes.size()) return Damaged("its list of channels");
    const std::string_view known = kTypes.at(type);
    header.sample_type = header.channels.empty() || header.sample_type == known ? known : "mixed";
    header.channels.emplace_back(name);
  }
  return list.ok() && !header.channels.empty() ? Status::Ok() : Damaged("its list of channels");
}

Status ReadExrWindow(HeaderBytes window, PictureHeader& header) {
  std::array<std::int64_t, 4> corners{};
  for (std::int64_t& corner : corners) corner = std::bit_cast<std::int32_t>(window.LittleEndian());
  const std::int64_t width = corners[2] - corners[0] + 1, height = corners[3] - corners[1] + 1;
  constexpr std::int64_t kMost = 0x7FFFFFFF;
  if (!window.ok() || width < 1 || height < 1 || width > kMost || height > kMost) return Damaged("its data window");
  header.width = std::uint32_t(width);
  header.height = std::uint32_t(height);
  return Status::Ok();
}

void ReadExrDensity(HeaderBytes value, PictureHeader& header) {
  const float per_inch = std::bit_cast<float>(value.LittleEndian());
  if (value.ok() && per_inch > 0 && per_inch < 1e9F) header.pixel_mm = 25.4 / double(per_inch);
}

// A file is a signature, a version and attributes: name, type, length, value; an empty name ends them. Of a file with several parts this is
// the first one.
Status ReadExr(HeaderBytes file, PictureHeader& header) {
  header.format = "EXR";
  file.Take(4);
  for (;;) {
    const std::string_view name = file.Text();
    if (!file.ok()) return Damaged("it ends within its header");
    if (name.empty()) break;
    const std::string_view type = file.Text();
    const std::string_view value = file.Take(file.LittleEndian());
    if (!file.ok()) return Damaged("it ends within its header");
    Status status;
    if (name == "channels" && type == "chlist") status = ReadExrChannels(HeaderBytes(value), header);
    if (name == "dataWindow" && type == "box2i") status = ReadExrWindow(HeaderBytes(value), header);
    if (name == "xDensity" && type == "float") ReadExrDensity(HeaderBytes(value), header);
    if (name == kRecordName && type == "string") header.record = value;
    if (!status.ok()) return status;
  }
  return header.width > 0 && !header.channels.empty() ? Status::Ok() : Damaged("it has no size or no channels");
}

Status ReadHeader(std::string_view bytes, PictureHeader& header) {
  HeaderBytes file(bytes);
  if (bytes.starts_with(kPngSignature)) {
    file.Take(kPngSignature.size());
    return ReadPng(file, header);
  }
  if (bytes.starts_with(kExrSignature)) {
    file.Take(kExrSignature.size());
    return ReadExr(file, header);
  }
  return Status::InvalidArgument("is neither a PNG nor an EXR file");
}

}  // namespace

bool IsPicturePath(const std::string& path) {
  const std::optional<PictureFileType> type = PictureFileTypeOf(path);
  return type == PictureFileType::kPng || type == PictureFileType::kExr;
}

Result<PictureHeader> ReadPictureHeader(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return Status::NotFound(fmt::format("'{}' does not exist", path));
  if (!std::filesystem::is_regular_file(path, error)) return Status::InvalidArgument(fmt::format("'{}' is no file", path));
  const std::uintmax_t whole = std::filesystem::file_size(path, error);
  std::string bytes(std::size_t(std::min<std::uintmax_t>(error ? 0 : whole, kMaxPictureHeaderBytes)), '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), std::streamsize(bytes.size()))) return Status::InvalidArgument(fmt::format("'{}' cannot be read", path));
  PictureHeader header;
  const Status status = ReadHeader(bytes, header);
  if (!status.ok()) return Printable(Status::InvalidArgument(fmt::format("'{}' {}", path, status.message())));
  return header;
}

}  // namespace slabstream
