#include "data/layers/color_table.h"

#include <algorithm>
#include <cmath>

#include "common/base/printable.h"
#include "common/files/files.h"

namespace slabstream {

// Each in the file of its format, or in that of text tables.
ColorTableFormat ByteLut();
ColorTableFormat FreeSurferLut();
ColorTableFormat FslLut();
ColorTableFormat IndexedColors();
ColorTableFormat ItkSnapLabels();

const std::vector<ColorTableFormat>& ColorTableFormats() {
  static const std::vector<ColorTableFormat> formats = {ByteLut(), IndexedColors(), ItkSnapLabels(), FreeSurferLut(), FslLut()};
  return formats;
}

Result<ColorTable> ParseColorTable(std::string_view file, const std::string& path) {
  std::string names;
  for (const ColorTableFormat& format : ColorTableFormats()) {
    names += (names.empty() ? "" : ", ") + std::string(format.name);
    if (!format.recognises(file)) continue;
    Result<ColorTable> table = format.read(file);
    if (table.ok()) return table;
    return Printable(Status(table.status().code(), path + ": " + table.status().message()));
  }
  return Printable(Status::InvalidArgument(path + ": not a table of label colours, which is one of " + names));
}

Result<ColorTable> ReadColorTable(const std::string& path) {
  const Result<std::string> file = ReadTextFile(path, kMaxColorTableBytes);
  if (!file.ok()) return Printable(file.status());
  return ParseColorTable(*file, path);
}

LabelColor StandardColor(std::uint32_t value) {
  // Hues that follow each other by the golden section are far apart, however many there are.
  constexpr double kGoldenSection = 0.6180339887498949;
  const double hue = 6 * std::fmod(value * kGoldenSection, 1.0);
  const double saturation = value / 3 % 2 == 0 ? 0.75 : 0.5, brightness = value % 3 == 0 ? 0.75 : 1;
  LabelColor color{};
  for (std::size_t i = 0; i < color.size(); ++i) {
    // HSV to RGB: each channel falls and rises along the hue (Smith 1978).
    const double k = std::fmod(5 - 2 * double(i) + hue, 6.0);
    color.at(i) = float(brightness * (1 - saturation * std::max(0.0, std::min({k, 4 - k, 1.0}))));
  }
  return color;
}

}  // namespace slabstream
