#include "client/pictures/exif.h"

#include <cmath>
#include <cstdint>

namespace slabstream {
namespace {

constexpr unsigned kAscii = 2, kShort = 3, kRational = 5;  // types
constexpr unsigned kImageDescription = 270, kXResolution = 282, kYResolution = 283, kResolutionUnit = 296, kSoftware = 305;

std::string LittleEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += char(value >> (8 * i) & 0xFFU);
  return text;
}

// Entries in the order of their tags, and behind them the values that do not fit into an entry.
class Directory {
 public:
  explicit Directory(std::size_t entries) : values_at_(8 + 2 + 12 * entries + 4) {}

  void Add(unsigned tag, unsigned type, std::size_t count, std::string value) {
    entries_ += LittleEndian(tag, 2) + LittleEndian(type, 2) + LittleEndian(count, 4);
    if (value.size() <= 4) {
      value.resize(4);
      entries_ += value;
    } else {
      entries_ += LittleEndian(values_at_ + values_.size(), 4);
      values_ += value;
      if (values_.size() % 2 == 1) values_ += '\0';
    }
    ++count_;
  }
  void AddText(unsigned tag, const std::string& text) { Add(tag, kAscii, text.size() + 1, text + '\0'); }

  std::string Block() const {
    return std::string("II*\0", 4) + LittleEndian(8, 4) + LittleEndian(count_, 2) + entries_ + LittleEndian(0, 4) + values_;
  }

 private:
  std::size_t values_at_;
  std::size_t count_ = 0;
  std::string entries_, values_;
};

}  // namespace

std::string ExifBlock(const EncodedFormat& format) {
  if (!format.density && format.record.empty()) return {};
  Directory directory((format.density ? 3U : 0U) + (format.record.empty() ? 0U : 2U));
  if (!format.record.empty()) directory.AddText(kImageDescription, format.record);
  if (format.density) {
    const double per_inch = *format.density * kMetresAnInch;
    constexpr double kFine = 1e5;  // below it there is room for four more digits in 32 bits
    const std::uint64_t parts = per_inch < kFine ? 10000 : 1;
    const std::string resolution = LittleEndian(std::uint64_t(std::llround(per_inch * double(parts))), 4) + LittleEndian(parts, 4);
    directory.Add(kXResolution, kRational, 1, resolution);
    directory.Add(kYResolution, kRational, 1, resolution);
    directory.Add(kResolutionUnit, kShort, 1, LittleEndian(2, 2));  // an inch
  }
  if (!format.record.empty()) directory.AddText(kSoftware, format.software);
  return directory.Block();
}

}  // namespace slabstream
