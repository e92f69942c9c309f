// FreeSurferColorLUT.txt and its like: a line for each label, with its value, its name without spaces, and red, green, blue and
// transparency in [0, 255]. Transparency does not count here; what shows is up to the request.
#include "data/layers/table_lines.h"

namespace slabstream::free_surfer {
namespace {

constexpr std::size_t kWords = 5;  // transparency may be left out

bool Recognises(std::string_view file) {
  const auto words = FirstWords(file);
  if (words.size() < kWords || IsNumber(words[1])) return false;
  return IsNumber(words[0]) && IsNumber(words[2]) && IsNumber(words[3]) && IsNumber(words[4]);
}

Result<ColorTable> Read(std::string_view file) {
  ColorTable table;
  for (TableLines lines(file); lines.Next();) {
    if (lines.words().size() < kWords) return lines.Wrong("must be VALUE NAME RED GREEN BLUE TRANSPARENCY");
    if (Status added = lines.AddLabel(table, 2, 255, std::string(lines.words()[1])); !added.ok()) return added;
  }
  return table;
}

}  // namespace

ColorTableFormat Format() { return {"FreeSurfer colour LUT", Recognises, Read}; }

}  // namespace slabstream::free_surfer
