// Says all that this program makes of a volume, a grid of cells or a shape without drawing it, for tests/ablation/run.py. Each line of
// standard input is a JSON object:
//
//   source   PATH?OPTION=VALUE,..., as users name it
//   output   where arrays go, as float64 one behind the other
//
// For each one line of JSON is answered: `facts` (an object), `arrays` (name and count of numbers of each, in the order of the file),
// `notes` (for people, with the lines of the log), or `error`.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/json/json.h"
#include "common/shapes/shape.h"
#include "common/view/picture_geometry.h"
#include "common/volume/labels.h"
#include "common/volume/volume.h"
#include "data/catalogue/catalogue.h"
#include "data/catalogue/dataset_fields.h"
#include "data/catalogue/shape_data.h"
#include "data/layers/label_table.h"
#include "data/open/open_source.h"
#include "data/open/read_volume.h"
#include "data/shapes/shape_file.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMostVoxels = 1 << 18;  // samples are small; a file that says to be larger is described, not read
constexpr int kMostTimes = 6, kMostChannels = 8;

// What has been found so far.
class Observed {
 public:
  explicit Observed(const std::string& output) : file_(output, std::ios::binary | std::ios::trunc) {}

  Json facts = Json::object();
  std::vector<std::string> notes;

  template <class T>
  void AddArray(const std::string& name, std::span<const T> numbers) {
    const std::vector<double> wide(numbers.begin(), numbers.end());
    AddNumbers(name, wide);
  }
  template <class T, std::size_t N>
  void AddRows(const std::string& name, const std::vector<std::array<T, N>>& rows) {
    std::vector<double> wide;
    for (const std::array<T, N>& row : rows) wide.insert(wide.end(), row.begin(), row.end());
    AddNumbers(name, wide);
  }
  void AddNumbers(const std::string& name, const std::vector<double>& numbers) {
    file_.write(reinterpret_cast<const char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(double)));
    arrays_.push_back({name, numbers.size()});
  }

  Json Answer() {
    file_.flush();
    return {{"facts", std::move(facts)}, {"arrays", std::move(arrays_)}, {"notes", notes}};
  }

 private:
  std::ofstream file_;
  Json arrays_ = Json::array();
};

Json Numbers(const Vec3& v) { return {v.x, v.y, v.z}; }

Json GeometryJson(const VolumeGeometry& geometry) {
  const Orientation& at = geometry.orientation;
  Json json = {{"size", {geometry.size.x, geometry.size.y, geometry.size.z}},
               {"spacing", Numbers(geometry.spacing)},
               {"origin", Numbers(at.origin)},
               {"axes", {Numbers(at.axes[0]), Numbers(at.axes[1]), Numbers(at.axes[2])}},
               {"world", NameOf(at.world)},
               {"unit", NameOf(UnitOf(geometry))}};
  for (const Axis axis : kAxes) {
    if (!geometry.stretch.knots(axis).empty()) json[fmt::format("places_{}", Letter(axis))] = geometry.stretch.knots(axis);
  }
  return json;
}

Json ColorJson(const std::optional<std::array<float, 3>>& color) { return color ? Json{(*color)[0], (*color)[1], (*color)[2]} : Json(); }

Json FieldsJson(const DatasetFields& fields) {
  Json list = Json::array();
  for (const FieldInfo& field : fields.fields) {
    list.push_back({{"name", field.name},
                    {"labels", field.labels},
                    {"color", ColorJson(field.color)},
                    {"window", field.window ? Json{field.window->min, field.window->max} : Json()},
                    {"shown", field.shown}});
  }
  return list;
}

std::vector<double> ValuesOf(const VoxelBlock& block, const ValueMapping& mapping) {
  std::vector<double> values;
  values.reserve(std::size_t(block.box.voxel_count()));
  VisitStoredType(block.type, [&]<class T>(const T*) {
    for (const T sample : std::span(block.samples<T>(), std::size_t(block.box.voxel_count()))) {
      values.push_back(mapping.FromStored(double(sample)));
    }
  });
  return values;
}

bool TooLarge(const VolumeDescription& level) { return level.geometry.bounds().voxel_count() > kMostVoxels; }

// The voxels of one channel at one time, at all levels.
Status ObserveVoxels(VolumeSource& source, const std::string& path, const ReadOptions& options, Observed& observed) {
  const SourceInfo& info = source.info();
  const std::string name = fmt::format("t{}c{}", info.time, info.channel);
  const Result<LoadedVolume> finest = ReadVolume(source, path, options);
  if (!finest.ok()) return finest.status();
  observed.AddNumbers(name, ValuesOf(finest->volume->block, finest->volume->description.mapping));
  if (finest->volume->cells != nullptr) {
    const Mesh& mesh = *finest->volume->cells;
    observed.facts["tetrahedra"] = mesh.tetrahedra.size();
    observed.facts["values_at"] = NameOf(mesh.at);
    observed.AddArray(name + "/cells", std::span<const float>(mesh.values));
  }
  for (std::size_t level = 1; level < info.levels.size(); ++level) {
    const VolumeDescription& description = info.levels[level].description;
    if (TooLarge(description)) continue;
    VoxelBlock block = MakeVoxelBlock(description.geometry.bounds(), description.type);
    if (Status status = source.ReadNow(int(level), block.box, std::span<std::byte>(block.bytes.data(), block.bytes.size())); !status.ok())
      return status;
    observed.AddNumbers(fmt::format("{}/level{}", name, level), ValuesOf(block, description.mapping));
  }
  return Status::Ok();
}

void ObserveLabels(const SourceInfo& info, const std::string& path, Observed& observed) {
  const Result<FoundColors> colors = ReadLabelColors(path, "");
  const LabelTable table = MakeLabelTable(std::nullopt, colors.ok() ? colors->table : ColorTable(), info.looks);
  Json labels = Json::array();
  for (const Label& label : table.labels) labels.push_back({label.value, label.name, ColorJson(label.color)});
  observed.facts["table"] = std::move(labels);
}

Status ObserveVolume(const std::string& text, Observed& observed) {
  const Result<SourceText> named = ParseSourceText(text);
  if (!named.ok()) return named.status();
  if (Status status = CheckVolume(named->path, named->options); !status.ok()) return status;
  ReadOptions options = named->options;
  options.describe = true;
  const Result<std::shared_ptr<VolumeSource>> source = OpenSource(named->path, options, ProcessReadContext());
  if (!source.ok()) return source.status();
  const SourceInfo& info = (*source)->info();
  Json levels = Json::array();
  for (const SourceLevel& level : info.levels) levels.push_back(GeometryJson(level.description.geometry));
  observed.facts = {{"kind", "volume"},        {"format", info.format}, {"labels", info.labels},      {"components", info.components},
                    {"channel", info.channel}, {"time", info.time},     {"levels", std::move(levels)}};
  observed.facts["times"] = {info.times.count, info.times.step ? Json(*info.times.step) : Json(), info.times.unit};
  const DataSource catalogued(text, "");
  const std::shared_ptr<const DatasetFields> fields = FieldsOf(catalogued, info);
  if (fields != nullptr) observed.facts["fields"] = FieldsJson(*fields);
  observed.facts["channels"] = FieldsJson({.fields = info.channels});
  if (info.labels) ObserveLabels(info, named->path, observed);
  observed.notes = info.notes;
  if (TooLarge(info.finest())) {
    observed.facts["too_large"] = true;
    return Status::Ok();
  }
  const bool all_times = !named->options.time, all_channels = !named->options.channel;
  const int times = all_times ? std::min(info.times.count, kMostTimes) : 1;
  const int channels = all_channels ? std::clamp(int(info.channels.size()), 1, kMostChannels) : 1;
  for (int time = 0; time < times; ++time) {
    for (int channel = 0; channel < channels; ++channel) {
      ReadOptions part = named->options;
      if (all_times && info.times.count > 1) part.time = TimeRange{time, time};
      if (all_channels && info.channels.size() > 1) part.channel = channel;
      part.describe = true;
      const Result<std::shared_ptr<VolumeSource>> other = OpenSource(named->path, part, ProcessReadContext(), source->get());
      if (!other.ok()) return other.status();
      const std::vector<std::string>& notes = (*other)->info().notes;
      for (const std::string& note : notes) {
        if (std::find(observed.notes.begin(), observed.notes.end(), note) == observed.notes.end()) observed.notes.push_back(note);
      }
      if (Status status = ObserveVoxels(**other, named->path, part, observed); !status.ok()) return status;
    }
  }
  return Status::Ok();
}

Status ObserveShape(const std::string& text, Observed& observed) {
  const Result<ShapeFile> file = FindShapeFile(text);
  if (!file.ok()) return file.status();
  const Result<Shape> shape = ReadShape(file->path);
  if (!shape.ok()) return shape.status();
  observed.facts = {{"kind", NameOf(shape->kind)}, {"origin", Numbers(shape->origin)}};
  observed.facts["times"] = {file->times.count, file->times.step ? Json(*file->times.step) : Json(), file->times.unit};
  std::vector<double> places;
  for (const auto& [x, y, z] : shape->positions) {
    places.insert(places.end(), {x + shape->origin.x, y + shape->origin.y, z + shape->origin.z});
  }
  observed.AddNumbers("places", places);
  observed.AddRows("normals", shape->normals);
  observed.AddRows("colors", shape->colors);
  observed.AddArray("values", std::span<const float>(shape->values));
  observed.AddArray("radii", std::span<const float>(shape->radii));
  observed.AddRows("triangles", shape->triangles);
  observed.AddArray("line_begins", std::span<const std::uint32_t>(shape->line_begins));
  return Status::Ok();
}

Status ObserveCells(const std::string& text, Observed& observed) {
  const Result<SourceText> named = ParseSourceText(text);
  if (!named.ok()) return named.status();
  const Result<LoadedMesh> loaded =
      ReadMesh(named->path, {.array = named->options.array, .time = named->options.time, .channel = named->options.channel});
  if (!loaded.ok()) return loaded.status();
  const MeshFileInfo& info = loaded->info;
  observed.notes = info.notes;
  Json arrays = Json::array();
  for (const GridArray& array : info.arrays) arrays.push_back({array.name, NameOf(array.at), array.components, array.TypeText()});
  observed.facts["cells"] = {
      {"format", info.format}, {"points", info.points}, {"cells", info.cells}, {"arrays", std::move(arrays)}, {"array", info.array}};
  std::vector<double> points;
  for (const Vector3<float>& p : loaded->mesh.points) {
    points.insert(points.end(), {p.x + loaded->bounds.low.x, p.y + loaded->bounds.low.y, p.z + loaded->bounds.low.z});
  }
  observed.AddNumbers("cells/points", points);
  observed.AddArray("cells/values", std::span<const float>(loaded->mesh.values));
  std::vector<double> corners;
  for (const Tetrahedron& tetrahedron : loaded->mesh.tetrahedra) corners.insert(corners.end(), tetrahedron.begin(), tetrahedron.end());
  observed.AddNumbers("cells/tetrahedra", corners);
  return Status::Ok();
}

// A grid of cells is a volume, too: its values on a lattice.
Status Observe(const std::string& text, Observed& observed) {
  if (NamesShape(text)) return ObserveShape(text, observed);
  if (Status status = ObserveVolume(text, observed); !status.ok()) return status;
  const Result<SourceText> named = ParseSourceText(text);
  return named.ok() && LooksLikeMesh(named->path) ? ObserveCells(text, observed) : Status::Ok();
}

// The log, which goes to stderr, since it was last asked.
class LogLines {
 public:
  LogLines() : file_(::memfd_create("log", 0)) {
    ::fcntl(file_, F_SETFL, O_APPEND);
    ::dup2(file_, STDERR_FILENO);
  }
  std::vector<std::string> Take() {
    std::string text(std::size_t(::lseek(file_, 0, SEEK_END)), '\0');
    const ssize_t read = ::pread(file_, text.data(), text.size(), 0);
    text.resize(std::size_t(std::max<ssize_t>(read, 0)));
    if (::ftruncate(file_, 0) != 0) std::abort();
    std::vector<std::string> lines;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      // Behind date, time and level.
      const std::string line = text.substr(begin, end - begin);
      const std::size_t level = line.find("] ");
      lines.push_back(level == std::string::npos ? line : line.substr(level + 2));
      begin = end + 1;
    }
    return lines;
  }

 private:
  int file_;
};

}  // namespace
}  // namespace slabstream

int main() {
  constexpr rlim_t kMostBytes = rlim_t{4} << 30;
  const rlimit limit = {kMostBytes, kMostBytes};
  ::setrlimit(RLIMIT_AS, &limit);
  slabstream::LogLines log;
  std::string line;
  while (std::getline(std::cin, line)) {
    const slabstream::Json request = slabstream::Json::Parse(line).value();
    slabstream::Observed observed(request.at("output").get<std::string>());
    const slabstream::Status status = slabstream::Observe(request.at("source").get<std::string>(), observed);
    for (std::string& told : log.Take()) observed.notes.push_back(std::move(told));
    slabstream::Json answer = observed.Answer();
    if (!status.ok()) answer["error"] = status.message();
    std::cout << answer.dump() << std::endl;
  }
}
