// Colour tables of labels, of every format.
//
// input: the file
#include "data/layers/color_table.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {

bool DecodeColorTable(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const Result<ColorTable> table = ParseColorTable(input.Text(), "table");
  if (!table.ok()) {
    CheckRefusal(table.status());
    return false;
  }
  CHECK_LE(table->entries.size(), kMaxColorTableEntries);
  CHECK_LE(table->sequence.size(), kMaxColorTableEntries);
  const auto check = [](const LabelColor& color) {
    for (const float channel : color) CHECK(channel >= 0 && channel <= 1) << channel;
  };
  for (const auto& [value, entry] : table->entries) {
    check(entry.color);
  }
  for (const LabelColor& color : table->sequence) check(color);
  return true;
}

std::vector<FuzzBytes> ColorTableSeeds() {
  std::string lut(768, '\0');
  for (std::size_t i = 0; i < lut.size(); ++i) lut[i] = char(i % 251);
  std::vector<FuzzBytes> seeds;
  for (const std::string& file :
       {lut, std::string("# labels\n1 255 0 0 1 1 1 \"Left lung\"\n"), std::string("2 Left-Cerebral 245 245 245 0\n"),
        std::string("1 0.5 0 1 Frontal Pole\n"), std::string(R"([{"IndexedColors": [1, 0, 0], "Annotations": ["4", "four"]}])")}) {
    seeds.push_back(FuzzSeed().Put(std::string_view(file)).bytes());
  }
  return seeds;
}

}  // namespace slabstream
