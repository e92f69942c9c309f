#include "data/layers/label_table.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "common/text/utf8.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

// X.nii.lut beside X.nii or X.nii.gz; "": there is none.
std::string FileBeside(const std::string& volume, std::string_view ending) {
  fs::path path = volume;
  if (path.extension() == ".gz") path.replace_extension();
  if (path.extension() != ".nii") return "";
  path += ending;
  std::error_code error;
  return fs::exists(path, error) ? path.string() : "";
}

// What one line can show, of at most kMaxLabelNameBytes, whole characters.
std::string AsName(const std::string& text) {
  std::string name;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t bytes = Utf8CharacterBytes(rest);
    if (name.size() + std::max<std::size_t>(bytes, 1) > kMaxLabelNameBytes) break;
    name += bytes == 0 ? std::string("?") : std::string(rest.substr(0, bytes));
    rest.remove_prefix(std::max<std::size_t>(bytes, 1));
  }
  return Printable(name);
}

// Names by value, of lines with a number and a name; other lines do not count.
std::map<std::uint64_t, std::string> ReadNames(const std::string& path) {
  std::map<std::uint64_t, std::string> names;
  const Result<std::string> file = ReadTextFile(path, kMaxColorTableBytes);
  if (!file.ok()) return names;
  constexpr std::string_view kSpace = " \t\r";
  for (std::string_view rest = *file; !rest.empty();) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const std::size_t space = line.find_first_of(kSpace);
    if (space == std::string_view::npos) continue;
    const auto value = ParseNumber<std::uint64_t>(line.substr(0, space));
    line.remove_prefix(std::min(line.find_first_not_of(kSpace, space), line.size()));
    if (value && names.size() < kMaxColorTableEntries) names.emplace(*value, line.substr(0, line.find_first_of(kSpace)));
  }
  return names;
}

Label LookOf(std::uint64_t value, const ColorTable& table) {
  Label label{.value = value, .color = StandardColor(value)};
  if (const auto entry = table.entries.find(value); entry != table.entries.end()) {
    label.color = entry->second.color;
    label.name = AsName(entry->second.name);
  } else if (!table.sequence.empty()) {
    label.color = table.sequence[(value - 1) % table.sequence.size()];
  }
  return label;
}

ColorTable TableOf(const std::vector<StatedLabel>& looks) {
  ColorTable table;
  for (const StatedLabel& look : looks)
    table.entries.emplace(look.value, ColorTable::Entry{look.color.value_or(StandardColor(look.value)), look.name});
  return table;
}

}  // namespace

Result<FoundColors> ReadLabelColors(const std::string& labels, const std::string& named) {
  FoundColors found;
  const std::string colors = named.empty() ? FileBeside(labels, ".lut") : named;
  const std::string names = named.empty() ? FileBeside(labels, ".txt") : "";
  if (!colors.empty()) {
    Result<ColorTable> read = ReadColorTable(colors);
    if (!read.ok()) return read.status();
    found.files.push_back(colors);
    found.table = *std::move(read);
  }
  if (!names.empty()) {
    found.files.push_back(names);
    for (const auto& [value, name] : ReadNames(names)) {
      found.table.entries.try_emplace(value, ColorTable::Entry{StandardColor(value), {}}).first->second.name = name;
    }
  }
  return found;
}

std::optional<std::vector<std::uint64_t>> ValuesOfLabels(const Volume& labels) {
  std::unordered_set<std::uint64_t> met;
  VisitLabelType(labels.block.type, [&]<class T>(const T*) {
    const T* const samples = labels.block.samples<T>();
    const auto count = std::size_t(labels.block.box.voxel_count());
    for (std::size_t i = 0; i < count && met.size() <= kMaxLabels; ++i) {
      if (samples[i] != 0 && (i == 0 || samples[i] != samples[i - 1])) met.insert(std::uint64_t(samples[i]));
    }
  });
  if (met.size() > kMaxLabels) return std::nullopt;
  std::vector<std::uint64_t> values(met.begin(), met.end());
  std::ranges::sort(values);
  return values;
}

LabelTable MakeLabelTable(const std::optional<std::vector<std::uint64_t>>& values, const ColorTable& colors,
                          const std::vector<StatedLabel>& stated) {
  const ColorTable& table = colors == ColorTable{} ? TableOf(stated) : colors;
  std::vector<std::uint64_t> known = values.value_or(std::vector<std::uint64_t>());
  if (!values) {
    for (const auto& [value, entry] : table.entries) known.push_back(value);
    for (std::size_t i = 0; i < (table.sequence.empty() ? 0 : kMaxLabels); ++i) known.push_back(i + 1);
    std::erase(known, 0);
    known.resize(std::min(known.size(), kMaxLabels));
  }
  LabelTable made{.labels = {}, .complete = values.has_value()};
  for (const std::uint64_t value : known) made.labels.push_back(LookOf(value, table));
  return made;
}

}  // namespace slabstream
