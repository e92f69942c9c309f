// Label descriptions of ITK-SNAP: a line for each label, with its value, red, green and blue in [0, 255], opacity, whether it shows,
// whether its mesh shows, and its name in quotation marks. Colour and name count here; what shows is up to the request.
#include "data/layers/table_lines.h"

namespace slabstream::itk_snap {
namespace {

constexpr std::size_t kNumbers = 7;

bool Recognises(std::string_view file) {
  const auto words = FirstWords(file);
  if (words.size() <= kNumbers || !words[kNumbers].starts_with('"')) return false;
  for (std::size_t i = 0; i < kNumbers; ++i) {
    if (!IsNumber(words[i])) return false;
  }
  return true;
}

Result<ColorTable> Read(std::string_view file) {
  ColorTable table;
  for (TableLines lines(file); lines.Next();) {
    if (lines.words().size() <= kNumbers) return lines.Wrong("must be VALUE RED GREEN BLUE OPACITY VISIBLE MESH \"NAME\"");
    if (Status added = lines.AddLabel(table, 1, 255, lines.From(kNumbers)); !added.ok()) return added;
  }
  return table;
}

}  // namespace

ColorTableFormat Format() { return {"ITK-SNAP label descriptions", Recognises, Read}; }

}  // namespace slabstream::itk_snap
