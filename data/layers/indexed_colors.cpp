// ParaView's categorical colour maps: JSON with IndexedColors, three numbers in [0, 1] a colour, and Annotations, pairs of a value and its
// name, as texts. The i-th annotation has the i-th colour, and the first one again behind the last. Without Annotations the colours are
// those of the values 1, 2, 3 and so on.
#include <fmt/format.h>

#include <optional>

#include "common/json/json.h"
#include "common/text/parse_number.h"
#include "data/layers/color_table.h"

namespace slabstream {
namespace {

bool LooksLikeJson(std::string_view file) {
  const std::size_t first = file.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && (file[first] == '{' || file[first] == '[');
}

Result<std::vector<LabelColor>> ColorsOf(const Json& preset) {
  const Json& array = preset.at("IndexedColors");
  if (!array.is_array() || array.empty() || array.size() % 3 != 0 || array.size() > 3 * kMaxColorTableEntries) {
    return Status::InvalidArgument(
        fmt::format("IndexedColors must be an array of 3 numbers a colour, 1 to {} colours", kMaxColorTableEntries));
  }
  std::vector<LabelColor> colors(array.size() / 3);
  for (std::size_t i = 0; i < array.size(); ++i) {
    const double channel = array[i].is_number() ? array[i].get<double>() : -1;
    if (!(channel >= 0 && channel <= 1)) return Status::InvalidArgument(fmt::format("IndexedColors[{}] is not a number in [0, 1]", i));
    colors[i / 3].at(i % 3) = float(channel);
  }
  return colors;
}

// "12" and "12.0" are label 12.
constexpr std::uint64_t kMaxNamed = std::uint64_t{1} << 53;  // double holds all whole numbers up to here
std::optional<std::uint64_t> LabelNamed(const Json& text) {
  if (!text.is_string()) return std::nullopt;
  const auto value = ParseNumber<double>(text.text());
  if (!value || !(*value >= 0 && *value <= kMaxNamed) || *value != double(std::uint64_t(*value))) return std::nullopt;
  return std::uint64_t(*value);
}

Result<ColorTable> ReadPreset(const Json& preset) {
  if (!preset.is_object() || !preset.contains("IndexedColors")) return Status::InvalidArgument("a JSON file without IndexedColors");
  Result<std::vector<LabelColor>> colors = ColorsOf(preset);
  if (!colors.ok()) return colors.status();
  ColorTable table;
  if (!preset.contains("Annotations")) {
    table.sequence = *std::move(colors);
    return table;
  }
  const Json& pairs = preset["Annotations"];
  if (!pairs.is_array() || pairs.size() % 2 != 0 || pairs.size() > 2 * kMaxColorTableEntries) {
    return Status::InvalidArgument(
        fmt::format("Annotations must be an array of 2 texts a label, at most {} labels", kMaxColorTableEntries));
  }
  for (std::size_t i = 0; i < pairs.size(); i += 2) {
    const auto value = LabelNamed(pairs[i]);
    if (!value) return Status::InvalidArgument(fmt::format("Annotations[{}] is not a whole number in [0, {}] as a text", i, kMaxNamed));
    if (!pairs[i + 1].is_string()) return Status::InvalidArgument(fmt::format("Annotations[{}] is not a text", i + 1));
    const bool added = table.entries.emplace(*value, ColorTable::Entry{(*colors)[i / 2 % colors->size()], pairs[i + 1].text()}).second;
    if (!added) return Status::InvalidArgument(fmt::format("Annotations[{}]: label {} is given before", i, *value));
  }
  return table;
}

Result<ColorTable> ReadIndexedColors(std::string_view file) {
  const Result<Json> document = Json::Parse(file);
  if (!document.ok()) return document.status();
  if (document->is_array() && document->empty()) return Status::InvalidArgument("the array is empty");
  return ReadPreset(document->is_array() ? document->front() : *document);
}

}  // namespace

ColorTableFormat IndexedColors() { return {"ParaView IndexedColors", LooksLikeJson, ReadIndexedColors}; }

}  // namespace slabstream
