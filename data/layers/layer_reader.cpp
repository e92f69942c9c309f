#include "data/layers/layer_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "common/base/printable.h"
#include "common/files/files.h"
#include "common/text/parse_number.h"
#include "common/text/utf8.h"
#include "common/volume/memory_budget.h"
#include "data/layers/color_table.h"
#include "data/layers/layer_sampling.h"
#include "data/open/read_volume.h"
#include "data/volume_io/exact_samples.h"
#include "data/volume_io/read_options.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLabels = "labels ", kOverlay = "overlay ";

Status Prefixed(std::string_view what, const Status& status) { return Status(status.code(), std::string(what) + status.message()); }

bool IsFile(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// X.nii.lut beside X.nii or X.nii.gz; "": there is none.
std::string TableBeside(const std::string& volume, std::string_view ending) {
  fs::path path = volume;
  if (path.extension() == ".gz") path.replace_extension();
  if (path.extension() != ".nii") return "";
  path += ending;
  return IsFile(path.string()) ? path.string() : "";
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
std::map<std::uint32_t, std::string> ReadNames(const std::string& path) {
  std::map<std::uint32_t, std::string> names;
  const Result<std::string> file = ReadTextFile(path, kMaxColorTableBytes);
  if (!file.ok()) return names;
  constexpr std::string_view kSpace = " \t\r";
  for (std::string_view rest = *file; !rest.empty();) {
    std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const std::size_t space = line.find_first_of(kSpace);
    if (space == std::string_view::npos) continue;
    const auto value = ParseNumber<std::uint32_t>(line.substr(0, space));
    line.remove_prefix(std::min(line.find_first_not_of(kSpace, space), line.size()));
    if (value && names.size() < kMaxColorTableEntries) names.emplace(*value, line.substr(0, line.find_first_of(kSpace)));
  }
  return names;
}

struct LabelFilesFound {
  std::string volume, colors, names;
};
LabelFilesFound FindLabelFiles(const LayerFiles& files, const std::string& path) {
  if (!files.label_colors.empty()) return {path, files.label_colors, ""};
  return {path, TableBeside(path, ".lut"), TableBeside(path, ".txt")};
}

Result<ColorTable> ReadColors(const LabelFilesFound& files) {
  if (files.colors.empty() && files.names.empty()) return ColorTable{};
  ColorTable table;
  if (!files.colors.empty()) {
    Result<ColorTable> read = ReadColorTable(files.colors);
    if (!read.ok()) return read.status();
    table = *std::move(read);
  }
  if (!files.names.empty()) {
    for (const auto& [value, name] : ReadNames(files.names)) {
      ColorTable::Entry& entry = table.entries.try_emplace(value, ColorTable::Entry{StandardColor(value), {}}).first->second;
      entry.name = name;
    }
  }
  return table;
}

Label LookOf(std::uint32_t value, const ColorTable& table) {
  Label label{.value = value, .color = StandardColor(value)};
  if (const auto entry = table.entries.find(value); entry != table.entries.end()) {
    label.color = entry->second.color;
    label.name = AsName(entry->second.name);
  } else if (!table.sequence.empty()) {
    label.color = table.sequence[(value - 1) % table.sequence.size()];
  }
  return label;
}

// What the label volume itself says of its labels.
ColorTable TableOf(const std::vector<StatedLabel>& looks) {
  ColorTable table;
  for (const StatedLabel& look : looks) {
    if (look.value > kMaxLabelValue) continue;
    const auto value = std::uint32_t(look.value);
    table.entries.emplace(value, ColorTable::Entry{look.color.value_or(StandardColor(value)), look.name});
  }
  return table;
}

std::string_view WorldText(World world) {
  return world == World::kPatient ? "a patient" : world == World::kScene ? "a scene with axes of its own" : "no orientation";
}

Status CheckSameWorld(const VolumeGeometry& layer, const VolumeGeometry& grid) {
  if (layer.orientation.world == grid.orientation.world) return Status::Ok();
  return Status::InvalidArgument(fmt::format("its header has {}, that of the volume {}: they cannot be laid over each other",
                                             WorldText(layer.orientation.world), WorldText(grid.orientation.world)));
}

std::shared_ptr<const Volume> AsVolume(const VolumeGeometry& grid, VoxelBlock block) {
  auto volume = std::make_shared<Volume>();
  volume->description = {.geometry = grid, .type = block.type, .mapping = {}};
  volume->block = std::move(block);
  return volume;
}

// The labels of a volume: their values, ascending, without 0, and of each voxel which of them it has, from 1; 0: none.
struct FoundLabels {
  std::vector<std::uint32_t> values;
  VoxelBlock numbers;  // uint16
};

// Of a sample that is a data value, or of a data value.
template <class T>
std::optional<std::uint32_t> LabelOf(T value) {
  if constexpr (std::is_integral_v<T>) {
    return std::in_range<std::uint32_t>(value) && std::uint32_t(value) <= kMaxLabelValue ? std::optional(std::uint32_t(value))
                                                                                         : std::nullopt;
  } else {
    const bool is_label = value >= 0 && value <= double(kMaxLabelValue) && value == std::floor(value);
    return is_label ? std::optional(std::uint32_t(value)) : std::nullopt;
  }
}

template <class T>
Status NoLabel(T value) {
  return Status::InvalidArgument(fmt::format("the value {} is no label, which is a whole number in [0, {}]", value, kMaxLabelValue));
}

Result<FoundLabels> FindLabels(const Volume& labels, const ExactSamples* exact) {
  FoundLabels found{.values = {}, .numbers = MakeVoxelBlock(labels.block.box, ScalarType::kUint16)};
  auto* const numbers = found.numbers.samples<std::uint16_t>();
  const auto count = std::size_t(labels.block.box.voxel_count());
  // In the order in which they are met.
  std::unordered_map<std::uint32_t, std::uint16_t> met = {{0, 0}};
  const Status read = VisitBestSamples(labels, exact, [&]<class T>(const T* samples, const ValueMapping& mapping) {
    const bool plain = mapping == ValueMapping{};
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0 && samples[i] == samples[i - 1]) {  // most voxels have the label of the one before
        numbers[i] = numbers[i - 1];
        continue;
      }
      const std::optional<std::uint32_t> value = plain ? LabelOf(samples[i]) : LabelOf(mapping.FromStored(double(samples[i])));
      if (!value) return plain && std::is_integral_v<T> ? NoLabel(samples[i]) : NoLabel(mapping.FromStored(double(samples[i])));
      numbers[i] = met.emplace(*value, std::uint16_t(met.size())).first->second;
      if (met.size() > kMaxLabels + 1) return Status::InvalidArgument(fmt::format("more than {} labels", kMaxLabels));
    }
    return Status::Ok();
  });
  if (!read.ok()) return read;
  for (const auto& [value, number] : met) {
    if (value > 0) found.values.push_back(value);
  }
  std::ranges::sort(found.values);
  std::vector<std::uint16_t> by_value(met.size());  // by the number as it was met
  for (std::size_t i = 0; i < found.values.size(); ++i) by_value[met[found.values[i]]] = std::uint16_t(i + 1);
  for (std::uint16_t& number : std::span(numbers, count)) number = by_value[number];
  return found;
}

Result<Layers> LabelLayer(const LoadedVolume& read, const ColorTable& colors, const VolumeGeometry& grid, const std::string& path) {
  const auto wrong = [&](const Status& status) { return Status(status.code(), path + ": " + status.message()); };
  const VolumeGeometry& geometry = read.volume->description.geometry;
  if (Status status = CheckSameWorld(geometry, grid); !status.ok()) return wrong(status);
  const VolumeDescription numbered{.geometry = geometry, .type = ScalarType::kUint16, .mapping = {}};
  if (Status status = CheckFitsMemory(numbered.voxel_bytes(), path); !status.ok()) return status;
  const Result<FoundLabels> found = FindLabels(*read.volume, read.exact.get());
  if (!found.ok()) return wrong(found.status());
  auto table = std::make_shared<LabelTable>();
  for (const std::uint32_t value : found->values) table->labels.push_back(LookOf(value, colors));
  const ScalarType type = table->labels.size() < 256 ? ScalarType::kUint8 : ScalarType::kUint16;
  const VolumeDescription description{.geometry = grid, .type = type, .mapping = {}};
  if (Status status = CheckFitsMemory(description.voxel_bytes(), path); !status.ok()) return status;
  Layers layers;
  layers.labels = AsVolume(grid, NearestOn(grid, geometry, found->numbers, type));
  layers.table = std::move(table);
  return layers;
}

Status AddLabels(const LayerFiles& files, const VolumeGeometry& grid, Layers& layers) {
  Result<SourceText> source = ParseSourceText(files.labels);
  if (!source.ok()) return source.status();
  source->options.labels = true;
  Result<ColorTable> colors = ReadColors(FindLabelFiles(files, source->path));
  if (!colors.ok()) return colors.status();
  const Result<LoadedVolume> read = ReadVolume(source->path, source->options, true);
  if (!read.ok()) return read.status();
  if (*colors == ColorTable{}) colors = TableOf(read->info.looks);
  Result<Layers> made = LabelLayer(*read, *colors, grid, source->path);
  if (!made.ok()) return made.status();
  layers.labels = made->labels;
  layers.table = made->table;
  return Status::Ok();
}

}  // namespace

void SetLabelFiles(const std::string& text, LayerFiles& files) {
  const std::size_t colon = text.rfind(':');
  const auto exists = [](const std::string& volume) {
    const Result<SourceText> source = ParseSourceText(volume);
    return source.ok() && IsFile(source->path);
  };
  files.labels = text;
  files.label_colors.clear();
  if (colon == std::string::npos || colon + 1 == text.size() || exists(text) || !exists(text.substr(0, colon))) return;
  files.labels = text.substr(0, colon);
  files.label_colors = text.substr(colon + 1);
}

std::string LabelText(const LayerFiles& files) {
  return files.label_colors.empty() ? files.labels : files.labels + ":" + files.label_colors;
}

Result<std::vector<std::string>> CheckLayerHeaders(const LayerFiles& files) {
  std::vector<std::string> all;
  const auto check = [&](const std::string& text, std::string_view what) {
    const Result<SourceText> source = ParseSourceText(text);
    if (!source.ok()) return Prefixed(what, source.status());
    const Result<std::vector<std::string>> read = CheckVolumeHeaders(source->path, source->options);
    if (!read.ok()) return Prefixed(what, read.status());
    all.insert(all.end(), read->begin(), read->end());
    return Status::Ok();
  };
  if (!files.labels.empty()) {
    if (Status status = check(files.labels, kLabels); !status.ok()) return status;
    const LabelFilesFound found = FindLabelFiles(files, ParseSourceText(files.labels)->path);
    if (const Result<ColorTable> colors = ReadColors(found); !colors.ok()) return Prefixed(kLabels, colors.status());
    for (const std::string& file : {found.colors, found.names}) {
      if (!file.empty()) all.push_back(file);
    }
  }
  if (!files.overlay.empty()) {
    if (Status status = check(files.overlay, kOverlay); !status.ok()) return status;
  }
  return all;
}

Result<Layers> ReadLayers(const LayerFiles& files, const VolumeGeometry& grid) {
  Layers layers;
  if (!files.labels.empty()) {
    if (Status status = AddLabels(files, grid, layers); !status.ok()) return Prefixed(kLabels, status);
  }
  return layers;
}

}  // namespace slabstream
