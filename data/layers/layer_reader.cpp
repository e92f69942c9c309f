#include "data/layers/layer_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "common/base/files.h"
#include "common/base/parse_number.h"
#include "common/base/printable.h"
#include "common/base/utf8.h"
#include "common/volume/memory_budget.h"
#include "data/layers/color_table.h"
#include "data/layers/layer_sampling.h"
#include "data/open/any_volume.h"
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
ColorTable TableOf(const std::vector<LabelLook>& looks) {
  ColorTable table;
  for (const LabelLook& look : looks) {
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

// The data values of the voxels, ascending, without 0.
Result<std::vector<std::uint32_t>> ValuesOf(const Volume& labels) {
  return VisitScalarType(labels.block.type, [&]<class T>(const T*) -> Result<std::vector<std::uint32_t>> {
    std::vector<bool> met;
    std::size_t count = 0;
    const ValueMapping mapping = labels.description.mapping;
    T last{};
    bool any = false;
    for (const T sample : std::span(labels.block.samples<T>(), std::size_t(labels.block.box.voxel_count()))) {
      if (any && sample == last) continue;  // most voxels have the label of the one before
      last = sample;
      any = true;
      const double value = mapping.FromStored(double(sample));
      if (!(value >= 0 && value <= kMaxLabelValue) || value != std::floor(value)) {
        return Status::InvalidArgument(
            fmt::format("the value {:g} is no label, which is a whole number in [0, {}]", value, kMaxLabelValue));
      }
      const auto number = std::size_t(value);
      if (number >= met.size()) met.resize(number + 1);
      if (number == 0 || met[number]) continue;
      met[number] = true;
      if (++count > kMaxLabels) return Status::InvalidArgument(fmt::format("more than {} labels", kMaxLabels));
    }
    std::vector<std::uint32_t> values;
    for (std::size_t value = 1; value < met.size(); ++value) {
      if (met[value]) values.push_back(std::uint32_t(value));
    }
    return values;
  });
}

Result<Layers> LabelLayer(const Volume& labels, const ColorTable& colors, const VolumeGeometry& grid, const std::string& path) {
  const auto wrong = [&](const Status& status) { return Status(status.code(), path + ": " + status.message()); };
  if (Status status = CheckSameWorld(labels.description.geometry, grid); !status.ok()) return wrong(status);
  const Result<std::vector<std::uint32_t>> values = ValuesOf(labels);
  if (!values.ok()) return wrong(values.status());
  auto table = std::make_shared<LabelTable>();
  std::vector<std::uint16_t> numbers(values->empty() ? 1 : values->back() + 1);  // by value
  for (const std::uint32_t value : *values) {
    table->labels.push_back(LookOf(value, colors));
    numbers[value] = std::uint16_t(table->labels.size());
  }
  const ScalarType type = values->size() < 256 ? ScalarType::kUint8 : ScalarType::kUint16;
  const VolumeDescription description{.geometry = grid, .type = type, .mapping = {}};
  if (Status status = CheckFitsMemory(description.voxel_bytes(), path); !status.ok()) return status;
  const ValueMapping mapping = labels.description.mapping;
  Layers layers;
  layers.labels =
      AsVolume(grid, NearestOn(grid, labels, type, [&](double stored) { return numbers[std::size_t(mapping.FromStored(stored))]; }));
  layers.table = std::move(table);
  return layers;
}

Status AddLabels(const LayerFiles& files, const VolumeGeometry& grid, Layers& layers) {
  const Result<SourceText> source = ParseSourceText(files.labels);
  if (!source.ok()) return source.status();
  Result<ColorTable> colors = ReadColors(FindLabelFiles(files, source->path));
  if (!colors.ok()) return colors.status();
  const Result<LoadedVolume> read = ReadAnyVolume(source->path, source->options);
  if (!read.ok()) return read.status();
  if (*colors == ColorTable{}) colors = TableOf(read->info.looks);
  if (read->info.straightened) {
    return Status::InvalidArgument(source->path + ": its axes are not at right angles, and labels cannot be interpolated");
  }
  Result<Layers> made = LabelLayer(*read->volume, *colors, grid, source->path);
  if (!made.ok()) return made.status();
  layers.labels = made->labels;
  layers.table = made->table;
  return Status::Ok();
}

Status AddOverlay(const std::string& file, const VolumeGeometry& grid, Layers& layers) {
  const Result<SourceText> source = ParseSourceText(file);
  if (!source.ok()) return source.status();
  const Result<LoadedVolume> read = ReadAnyVolume(source->path, source->options);
  if (!read.ok()) return read.status();
  if (Status status = CheckSameWorld(read->info.description.geometry, grid); !status.ok()) {
    return Status(status.code(), source->path + ": " + status.message());
  }
  const VolumeDescription description{.geometry = grid, .type = ScalarType::kFloat32, .mapping = {}};
  if (Status status = CheckFitsMemory(description.voxel_bytes(), source->path); !status.ok()) return status;
  layers.overlay = AsVolume(grid, InterpolatedOn(grid, *read->volume));
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
    const Result<std::vector<std::string>> read = CheckAnyVolumeHeaders(source->path, source->options);
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
  if (!files.overlay.empty()) {
    if (Status status = AddOverlay(files.overlay, grid, layers); !status.ok()) return Prefixed(kOverlay, status);
  }
  return layers;
}

}  // namespace slabstream
