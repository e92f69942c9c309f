// The lines are those that ij.io.FileSaver of ImageJ 1 writes and ij.io.FileOpener and TiffDecoder read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

#include "common/text/parse_number.h"
#include "data/volume_io/binary_header.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/page_layout.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

using Lines = std::map<std::string, std::string>;

// The last of several lines with the same key counts, as for Java's properties.
Lines LinesOf(const std::string& description) {
  Lines lines;
  for (std::size_t begin = 0; begin < description.size();) {
    const std::size_t end = std::min(description.find_first_of("\r\n", begin), description.size());
    const std::string line = description.substr(begin, end - begin);
    if (const std::size_t equals = line.find('='); equals != std::string::npos) lines[line.substr(0, equals)] = line.substr(equals + 1);
    begin = end + 1;
  }
  return lines;
}

std::string TextOf(const Lines& lines, const std::string& key) {
  const auto found = lines.find(key);
  return found == lines.end() ? "" : found->second;
}

std::optional<double> NumberOf(const Lines& lines, const std::string& key) {
  const std::optional<double> number = ParseNumber<double>(TextOf(lines, key));
  return number && std::isfinite(*number) ? number : std::nullopt;
}

// The micro sign comes as an escape of Java, or alone in Latin 1.
std::string NameOfUnit(std::string text) {
  if (text.starts_with("\\u00B5") || text.starts_with("\\u00b5")) text.replace(0, 6, "u");
  if (text.starts_with("\xb5")) text.replace(0, 1, "u");
  return text;
}

// Of a pixel: the decimal number with fewest digits that the file's float stands for.
double PixelSize(double resolution) {
  if (!(resolution > 0) || !std::isfinite(1 / resolution)) return 1;
  return ParseNumber<double>(fmt::format("{}", float(1 / resolution))).value_or(1);
}

// As ImageJ decides: the description's unit, else that of the resolution.
std::string UnitOf(const Lines& lines, const TiffFile& first) {
  constexpr int kInch = 2, kCentimetre = 3;
  if (lines.contains("unit")) return NameOfUnit(TextOf(lines, "unit"));
  return first.ResolutionUnit() == kCentimetre ? "cm" : first.ResolutionUnit() == kInch ? "inch" : "";
}

void SetSpacing(const Lines& lines, const TiffFile& first, PageLayout& layout) {
  const std::string name = UnitOf(lines, first);
  const std::optional<double> between = NumberOf(lines, "spacing");
  if (!between && !lines.contains("unit") && name == "inch") return;  // a resolution for print
  Vec3 spacing{PixelSize(first.XResolution()), PixelSize(first.YResolution()), 1};
  if (between && *between != 0) spacing.z = std::abs(*between);  // ImageJ keeps a sign that says nothing of the order
  if (!between && (spacing.x != 1 || spacing.y != 1)) {
    layout.notes.emplace_back("the file states no distance of slices, which is 1 then, as in ImageJ; --spacing states another one");
  }
  layout.unit = LengthUnitNamed(name);
  const std::optional<double> micrometres = layout.unit ? std::nullopt : MicrometresIn(name);
  if (micrometres) {
    spacing = *micrometres * spacing;
    layout.unit = LengthUnit::kMicrometre;
  }
  layout.spacing = spacing;
  if (!layout.unit && !name.empty() && !name.starts_with("pixel")) {
    layout.notes.push_back(fmt::format("the unit of lengths, '{}', is not known", name));
  }
}

// A straight line alone is applied, as of 16-bit integers with a sign, which ImageJ stores 32768 too high.
void SetCalibration(const Lines& lines, SampleType type, PageLayout& layout) {
  const std::string function = TextOf(lines, "cf");
  const bool small = type == SampleType::kUint8 || type == SampleType::kUint16;  // ImageJ calibrates no others
  if (function.empty() || !small) return;
  const std::optional<double> offset = NumberOf(lines, "c0"), scale = NumberOf(lines, "c1");
  if (function != "0" || !offset || !scale || *scale == 0) {
    layout.notes.push_back(fmt::format("the calibration of values by ImageJ's function {} is not applied", function));
    return;
  }
  layout.rescale = {*scale, *offset};
  const std::string unit = TextOf(lines, "vunit");
  layout.notes.push_back(fmt::format("values are calibrated: {:g} + {:g} * sample{}", *offset, *scale, unit.empty() ? "" : ", " + unit));
}

// Windows and lookup tables of channels, which lie beside the description: first which kinds of entries there are and how many of each,
// behind a mark of four bytes; then the entries.
void SetLooks(const TiffFile& first, bool grey, PageLayout& layout) {
  constexpr unsigned kEntryBytes = 50838, kEntries = 50839;
  constexpr std::uint32_t kWindows = 0x72616e67, kTable = 0x6c757473;  // "rang", "luts"
  constexpr std::size_t kWindowBytes = 2 * sizeof(double), kTableBytes = 3 * 256;
  const std::span<const std::uint32_t> sizes = first.Numbers(kEntryBytes);
  const std::span<const std::byte> bytes = first.Bytes(kEntries);
  if (sizes.empty() || sizes.front() > bytes.size()) return;
  const BinaryHeader fields(bytes, first.big_endian());
  const std::size_t most = std::min(std::size_t(layout.channels), kMostChannels);
  const auto channel = [&](std::size_t number) -> FieldInfo& {
    if (number >= layout.described.size()) layout.described.resize(number + 1);
    return layout.described[number];
  };
  const auto take = [&](std::uint32_t kind, std::size_t number, std::size_t begin, std::size_t size) {
    for (std::size_t i = 0; kind == kWindows && i < std::min(size / kWindowBytes, most); ++i) {
      const std::size_t at = begin + i * kWindowBytes;
      channel(i).window = StatedWindow(fields.At<double>(at), fields.At<double>(at + sizeof(double)), layout.rescale);
    }
    if (kind != kTable || size != kTableBytes || number >= most || grey) return;
    const auto brightest = [&](std::size_t component) { return std::to_integer<int>(bytes[begin + 256 * component + 255]) / 255.0; };
    channel(number).color = StatedColor(brightest(0), brightest(1), brightest(2));
  };
  std::size_t entry = 1, begin = sizes.front();
  for (std::size_t at = 4; at + 8 <= sizes.front(); at += 8) {
    const auto kind = fields.At<std::uint32_t>(at), count = fields.At<std::uint32_t>(at + 4);
    for (std::size_t i = 0; i < count && entry < sizes.size(); ++i, ++entry) {
      const std::size_t size = sizes[entry];
      if (size > bytes.size() - begin) return;
      take(kind, i, begin, size);
      begin += size;
    }
  }
}

// The window of the only channel. Of images with signed samples the limits are calibrated values, of others samples.
void SetWindow(const Lines& lines, PageLayout& layout) {
  const std::optional<double> least = NumberOf(lines, "min"), greatest = NumberOf(lines, "max");
  if (!least || !greatest || layout.channels > 1) return;
  constexpr ValueMapping kSigned = {1, -32768};
  const auto window = StatedWindow(*least, *greatest, layout.rescale == kSigned ? ValueMapping{} : layout.rescale);
  layout.described.resize(1);
  if (window) layout.described.front().window = window;
}

void SetTimes(const Lines& lines, PageLayout& layout) {
  layout.time_step = NumberOf(lines, "finterval");
  layout.time_unit = lines.contains("tunit") ? NameOfUnit(TextOf(lines, "tunit")) : "s";
  const std::optional<double> per_second = NumberOf(lines, "fps");
  if (layout.time_step || !per_second) return;
  layout.time_step = 1 / *per_second;
  layout.time_unit = "s";
}

}  // namespace

bool IsImageJHeader(const std::string& description) { return description.starts_with("ImageJ=") || description.starts_with("SCIFIO="); }

Result<PageLayout> ReadImageJHeader(const TiffFile& first, const RawHeader& header, const std::string& description) {
  const Lines lines = LinesOf(description);
  PageLayout layout{.source = "ImageJ"};
  std::int64_t images = 1;
  for (const auto& [key, count] : std::initializer_list<std::pair<const char*, std::int64_t*>>{
           {"images", &images}, {"slices", &layout.slices}, {"channels", &layout.channels}, {"frames", &layout.times}}) {
    const std::string text = TextOf(lines, key);
    if (text.empty()) continue;
    *count = ParseNumber<std::int64_t>(text).value_or(0);
    if (*count < 1 || *count > kMaxVolumes) {
      return first.Refused(fmt::format("{} in its ImageJ header is '{}', must be in [1, {}]", key, text, kMaxVolumes));
    }
  }
  if (layout.planes() == 1) layout.slices = images;
  if (std::string order = TextOf(lines, "order"); !order.empty() && order != "default") {
    std::ranges::transform(order, order.begin(), [](char c) { return c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c; });
    if (order.starts_with("XY")) order.erase(0, 2);
    std::string sorted = order;
    std::ranges::sort(sorted);
    if (sorted != "CTZ") return first.Refused(fmt::format("order in its ImageJ header is '{}', must be such as czt", order));
    layout.order = order;
  }
  SetSpacing(lines, first, layout);
  SetCalibration(lines, header.type, layout);
  SetLooks(first, TextOf(lines, "mode") == "grayscale", layout);
  SetWindow(lines, layout);
  SetTimes(lines, layout);
  return layout;
}

}  // namespace slabstream
