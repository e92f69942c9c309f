#include "client/report/dataset_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "client/report/volume_text.h"
#include "common/base/printable.h"
#include "common/volume/memory_budget.h"

namespace slabstream {
namespace {

bool HasLabels(const DatasetStatus& dataset) { return dataset.fields && dataset.fields->labels(); }
bool HasOverlay(const DatasetStatus& dataset) {
  return dataset.fields && !dataset.fields->fields[std::size_t(dataset.fields->values()) - 1].channel;
}

std::string LayersText(const DatasetStatus& dataset) {
  std::string text = HasLabels(dataset) ? "labels" : "";
  if (HasOverlay(dataset)) text += text.empty() ? "overlay" : ", overlay";
  if (dataset.cells > 0) text += fmt::format("{}{} cells", text.empty() ? "" : ", ", dataset.cells);
  return text.empty() ? "-" : text;
}

std::vector<VolumeDescription> LevelsOf(const DatasetStatus& dataset) {
  return dataset.levels.empty() ? std::vector{dataset.description} : dataset.levels;
}

Json LevelJson(const VolumeDescription& level) {
  const Index3& size = level.geometry.size;
  const Vec3& spacing = level.geometry.spacing;
  return {{"size", {size.x, size.y, size.z}}, {"spacing", {spacing.x, spacing.y, spacing.z}}, {"voxel_bytes", level.voxel_bytes()}};
}

// "name", and what its author shows as far as the file says it.
Json FieldJson(const FieldInfo& field) {
  Json json = {{"name", field.name}, {"channel", field.channel}, {"labels", field.labels}, {"shown", field.shown}};
  if (field.color) json["color"] = ColorText(*field.color);
  if (field.window) json["window"] = {field.window->min, field.window->max};
  return json;
}

Json TimesJson(const TimeAxis& times) {
  Json json = {{"count", times.count}};
  if (times.step) json["step"] = *times.step;
  if (!times.unit.empty()) json["unit"] = times.unit;
  return json;
}

// "    channels 0 (DAPI, #0000ff, 0 to 200), 1 (Actin, not shown); 3 times, 2.5 s apart". Nothing of a dataset with one channel and time.
std::string FieldsText(const DatasetFields& dataset) {
  std::string text;
  for (std::size_t i = 0; i < dataset.fields.size() && dataset.several(); ++i) {
    const FieldInfo& field = dataset.fields[i];
    std::vector<std::string> said;
    if (!field.name.empty()) said.push_back(Printable(field.name));
    if (!field.channel) said.emplace_back("with a grid of its own");
    if (field.color) said.push_back(ColorText(*field.color));
    if (field.window) said.push_back(fmt::format("{:g} to {:g}", field.window->min, field.window->max));
    if (!field.shown) said.emplace_back("not shown");
    text += fmt::format("{}{}{}", i == 0 ? "channels " : ", ", i, said.empty() ? "" : fmt::format(" ({})", fmt::join(said, ", ")));
  }
  const TimeAxis& times = dataset.times;
  if (times.count > 1) {
    text += fmt::format("{}{} times", text.empty() ? "" : "; ", times.count);
    if (times.step) text += fmt::format(", {:g} {} apart", *times.step, Printable(times.unit));
  }
  return text;
}

Json DatasetJson(const DatasetStatus& dataset) {
  Json entry = {{"name", dataset.name}, {"state", NameOf(dataset.state)}, {"is_shape", dataset.is_shape}};
  if (dataset.shape) {
    entry["shape"] = ShapeJson(*dataset.shape);
    entry["memory_bytes"] = dataset.memory_bytes;
  } else if (dataset.state == DatasetState::kReady) {
    const VolumeGeometry& geometry = dataset.description.geometry;
    entry["size"] = {geometry.size.x, geometry.size.y, geometry.size.z};
    entry["type"] = NameOf(dataset.description.type);
    entry["spacing"] = {geometry.spacing.x, geometry.spacing.y, geometry.spacing.z};
    entry["memory_bytes"] = dataset.memory_bytes;
    entry["layers"] = {{"labels", HasLabels(dataset)}, {"overlay", HasOverlay(dataset)}};
    entry["cells"] = dataset.cells;
    const DatasetFields fields = dataset.fields.value_or(DatasetFields());
    entry["fields"] = Json::array();
    for (const FieldInfo& field : fields.fields) entry["fields"].push_back(FieldJson(field));
    entry["times"] = TimesJson(fields.times);
    entry["field"] = fields.field;
    entry["time"] = fields.time;
    entry["levels"] = Json::array();
    for (const VolumeDescription& level : LevelsOf(dataset)) entry["levels"].push_back(LevelJson(level));
    entry["range"] = {{"min", dataset.range.min}, {"max", dataset.range.max}};
  }
  if (dataset.state == DatasetState::kFailed) entry["error"] = dataset.error;
  if (dataset.simulation) entry["simulation"] = SimulationJson(*dataset.simulation);
  entry["since_ms"] = dataset.since_ms;
  return entry;
}

}  // namespace

Json ShapeJson(const ShapeInfo& shape) {
  Json json = {{"kind", NameOf(shape.kind)}, {"vertices", shape.vertices}, {"parts", shape.parts}};
  json["low"] = {shape.low.x, shape.low.y, shape.low.z};
  json["high"] = {shape.high.x, shape.high.y, shape.high.z};
  json["colors"] = shape.has_colors;
  if (shape.has_values) json["range"] = {{"min", shape.least}, {"max", shape.largest}};
  return json;
}

std::string_view NameOf(DatasetState state) {
  switch (state) {
    case DatasetState::kUnloaded: return "unloaded";
    case DatasetState::kLoading: return "loading";
    case DatasetState::kReady: return "ready";
    case DatasetState::kFailed: break;
  }
  return "failed";
}

std::string AgeText(std::uint64_t milliseconds) {
  const double seconds = double(milliseconds) / 1000, hours = seconds / 3600;
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  if (hours < 2) return fmt::format("{:.0f} min", seconds / 60);
  return hours < 48 ? fmt::format("{:.1f} h", hours) : fmt::format("{:.1f} d", hours / 24);
}

Json DatasetsJson(const std::vector<DatasetStatus>& datasets) {
  Json json = Json::array();
  for (const DatasetStatus& dataset : datasets) json.push_back(DatasetJson(dataset));
  return json;
}

Json SimulationJson(const SimulationStatus& simulation) {
  Json parameters = Json::array();
  for (const auto& [name, least, most, value] : simulation.steered) {
    parameters.push_back({{"name", name}, {"value", value}, {"least", least}, {"most", most}});
  }
  return {{"time", simulation.time}, {"simulated", simulation.simulated}, {"parameters", std::move(parameters)}};
}

std::string SimulationText(const SimulationStatus& simulation) {
  std::string text = fmt::format("time {}, simulated {:g}\n", simulation.time, simulation.simulated);
  if (simulation.steered.empty()) return text;
  text += fmt::format("{:<16} {:>13} {:>13} {:>13}\n", "NAME", "VALUE", "LEAST", "MOST");
  for (const auto& [name, least, most, value] : simulation.steered) {
    text += fmt::format("{:<16} {:>13g} {:>13g} {:>13g}\n", name, value, least, most);
  }
  return text;
}

std::string DatasetTableText(const std::vector<DatasetStatus>& datasets) {
  constexpr std::size_t kColumns = 9;
  using Row = std::array<std::string, kColumns>;
  std::vector<Row> rows = {{"NAME", "STATE", "FOR", "SIZE", "TYPE", "SPACING", "LEVELS", "MEMORY", "LAYERS"}};
  for (const DatasetStatus& dataset : datasets) {
    Row row = {Printable(dataset.name), std::string(NameOf(dataset.state)), AgeText(dataset.since_ms), "-", "-", "-", "-", "-", "-"};
    if (dataset.shape) {
      row[3] = fmt::format("{} {}", dataset.shape->parts, PartsOf(dataset.shape->kind));
      row[4] = NameOf(dataset.shape->kind);
      row[7] = MemoryText(dataset.memory_bytes);
    } else if (dataset.state == DatasetState::kReady) {
      const Index3& size = dataset.description.geometry.size;
      const Vec3& spacing = dataset.description.geometry.spacing;
      row[3] = fmt::format("{} x {} x {}", size.x, size.y, size.z);
      row[4] = NameOf(dataset.description.type);
      row[5] = fmt::format("{:.4g} x {:.4g} x {:.4g}", spacing.x, spacing.y, spacing.z);
      row[6] = fmt::format("{}", LevelsOf(dataset).size());
      row[7] = MemoryText(dataset.memory_bytes);
      row[8] = LayersText(dataset);
    }
    rows.push_back(std::move(row));
  }
  std::array<std::size_t, kColumns> widths{};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < kColumns; ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t i = 0; i + 1 < kColumns; ++i) text += fmt::format("{:<{}}  ", rows[r][i], widths[i]);
    text += rows[r].back() + '\n';
    if (r == 0) continue;
    const std::string fields = datasets[r - 1].fields ? FieldsText(*datasets[r - 1].fields) : "";
    if (!fields.empty()) text += "    " + fields + '\n';
    if (const auto& simulation = datasets[r - 1].simulation) {
      text += fmt::format("    simulation at time {}, simulated {:g}, {} parameters\n", simulation->time, simulation->simulated,
                          simulation->steered.size());
    }
    if (datasets[r - 1].state == DatasetState::kFailed) text += "    " + Printable(datasets[r - 1].error) + '\n';
  }
  return text;
}

}  // namespace slabstream
