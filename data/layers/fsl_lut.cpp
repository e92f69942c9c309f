// The .lut of FSLeyes: a line for each label, with its value, red, green and blue in [0, 1], and its name. The name may be left out.
#include "data/layers/table_lines.h"

namespace slabstream::fsl_lut {
namespace {

constexpr std::size_t kNumbers = 4;

bool Recognises(std::string_view file) {
  const auto words = FirstWords(file);
  if (words.size() < kNumbers) return false;
  for (std::size_t i = 0; i < kNumbers; ++i) {
    if (!IsNumber(words[i])) return false;
  }
  return words.size() == kNumbers || !IsNumber(words[kNumbers]);
}

Result<ColorTable> Read(std::string_view file) {
  ColorTable table;
  for (TableLines lines(file); lines.Next();) {
    if (lines.words().size() < kNumbers) return lines.Wrong("must be VALUE RED GREEN BLUE NAME");
    if (Status added = lines.AddLabel(table, 1, 1, lines.From(kNumbers)); !added.ok()) return added;
  }
  return table;
}

}  // namespace

ColorTableFormat Format() { return {"FSLeyes LUT", Recognises, Read}; }

}  // namespace slabstream::fsl_lut
