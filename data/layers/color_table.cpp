#include "data/layers/color_table.h"

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

}  // namespace slabstream
