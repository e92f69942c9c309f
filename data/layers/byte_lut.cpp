// The .lut of NIH Image and MRIcron: 256 bytes of red, then as many of green and of blue, by value. Black means that the table has no
// colour for a value: MRIcron's own tables have it where nobody has chosen one.
#include <cstddef>

#include "data/layers/color_table.h"

namespace slabstream {
namespace {

constexpr std::size_t kColors = 256;

Result<ColorTable> ReadByteLut(std::string_view file) {
  ColorTable table;
  for (std::size_t value = 0; value < kColors; ++value) {
    LabelColor color{};
    for (std::size_t i = 0; i < color.size(); ++i) color.at(i) = float(static_cast<unsigned char>(file[i * kColors + value])) / 255;
    if (color != LabelColor{}) table.entries[std::uint64_t(value)] = {.color = color};
  }
  return table;
}

}  // namespace

ColorTableFormat ByteLut() {
  return {"LUT of 768 bytes", [](std::string_view file) { return file.size() == 3 * kColors; }, ReadByteLut};
}

}  // namespace slabstream
