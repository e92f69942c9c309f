// HDF5 files of openPMD: meshes of an iteration, each a dataset or a group with a dataset for each component. Iterations are times,
// components channels. Source: https://github.com/openPMD/openPMD-standard, STANDARD.md 1.1.0, "Mesh Based Records".
#include <fmt/format.h>

#include <algorithm>
#include <ranges>

#include "common/text/parse_number.h"
#include "data/hdf5/hdf5_image.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

std::string ParentOf(const std::string& path) { return path.substr(0, path.find_last_of('/')); }

// Attributes of a mesh lie with its dataset, or with the group of its components.
Result<std::optional<ImageDescription>> Describe(AttributedFile& file, const DatasetFacts& dataset) {
  const std::string& path = dataset.path;
  if (!IsOpenPmd(file)) return std::optional<ImageDescription>();
  const std::string mesh = file.Numbers(path, "gridSpacing") ? path : ParentOf(path);
  std::vector<double> spacing = file.Numbers(mesh, "gridSpacing").value_or(std::vector<double>());
  if (spacing.empty()) return std::optional<ImageDescription>();
  const std::size_t count = dataset.size.size();
  const std::string geometry = file.Text(mesh, "geometry").value_or("cartesian");
  if (geometry != "cartesian") {
    return Status::InvalidArgument(file.Named(path) +
                                   fmt::format(" has geometry '{}', which is not supported; supported: cartesian", geometry));
  }
  std::vector<std::string> labels = file.Texts(mesh, "axisLabels").value_or(std::vector<std::string>());
  const std::vector<double> none(count, 0);
  std::vector<double> offset = file.Numbers(mesh, "gridGlobalOffset").value_or(none),
                      position = file.Numbers(path, "position").value_or(none);
  if (position == std::vector<double>{0}) position = none;  // as openPMD-api writes that of a scalar if nobody sets it
  if (spacing.size() != count || labels.size() != count || offset.size() != count || position.size() != count) {
    return Status::InvalidArgument(
        file.Named(path) + fmt::format(" has {} axes, but {} in gridSpacing, {} in axisLabels, {} in gridGlobalOffset and {} in position",
                                       count, spacing.size(), labels.size(), offset.size(), position.size()));
  }
  // What Fortran writes has its axes in the other order here.
  if (file.Text(mesh, "dataOrder") == "F") {
    std::ranges::reverse(labels);
    for (std::vector<double>* numbers : {&spacing, &offset, &position}) std::ranges::reverse(*numbers);
  }
  const double unit = file.Numbers(mesh, "gridUnitSI").value_or(std::vector<double>{1}).front();
  ImageDescription image{.format = "openPMD", .axes_from = "axisLabels", .world = World::kScene};
  for (std::size_t i = 0; i < count; ++i) {
    image.axes.push_back(
        {.name = labels[i], .step = unit * spacing[i], .start = unit * (offset[i] + position[i] * spacing[i]), .unit = LengthUnit::kMetre});
  }
  if (const auto si = file.Numbers(path, "unitSI"); si && si->front() != 1) {
    image.notes.push_back(fmt::format("values times {} (unitSI) are in units of SI", si->front()));
  }
  return std::optional(std::move(image));
}

struct Iterations {
  std::vector<std::string> names;
  TimeAxis times;
};

Result<Iterations> IterationsOf(AttributedFile& file) {
  Iterations iterations;
  Result<std::vector<std::string>> names = file.Names("/data");
  if (!names.ok()) return names.status();
  std::vector<double> seconds;
  for (std::string& name : *names) {
    if (!ParseNumber<std::uint64_t>(name)) continue;
    const auto number = [&](const char* attribute, double otherwise) {
      return file.Numbers("/data/" + name, attribute).value_or(std::vector<double>{otherwise}).front();
    };
    seconds.push_back(number("time", 0) * number("timeUnitSI", 1));
    iterations.names.push_back(std::move(name));
  }
  if (iterations.names.empty() || iterations.names.size() > std::size_t(kMaxVolumes)) {
    return Status::InvalidArgument(fmt::format("{}: an openPMD file with {} iterations in /data, must have 1 to {}", file.path(),
                                               iterations.names.size(), kMaxVolumes));
  }
  iterations.times = StatedTimes(std::int64_t(seconds.size()), seconds, "s");
  return iterations;
}

// The datasets of a mesh, one for each component: a constant component has none.
struct PmdMesh {
  std::vector<std::string> paths;
  std::vector<FieldInfo> channels;  // with their names
};

PmdMesh MeshAt(AttributedFile& file, const std::string& path) {
  if (file.Describe(path).ok()) return {{path}, {}};
  PmdMesh mesh;
  const Result<std::vector<std::string>> names = file.Names(path);
  for (const std::string& name : names.ok() ? *names : std::vector<std::string>()) {
    if (!file.Describe(path + "/" + name).ok()) continue;
    mesh.paths.push_back(path + "/" + name);
    mesh.channels.push_back({.name = name});
  }
  return mesh;
}

// Of the meshes in this group the only one, or the one that options.dataset names.
Result<PmdMesh> ChosenMesh(AttributedFile& file, const std::string& group, const ReadOptions& options) {
  const Result<std::vector<std::string>> names = file.Names(group);
  if (!names.ok()) return names.status();
  std::vector<std::string> meshes;
  for (const std::string& name : *names) {
    if (!MeshAt(file, group + "/" + name).paths.empty()) meshes.push_back(name);
  }
  const std::string wanted = options.dataset.empty() && meshes.size() == 1 ? meshes.front() : options.dataset;
  if (std::ranges::find(meshes, wanted) != meshes.end()) return MeshAt(file, group + "/" + wanted);
  const std::string why = wanted.empty() ? "--dataset must take one of its meshes" : fmt::format("has no mesh {}", wanted);
  return Status::InvalidArgument(fmt::format("{}: {}; in {} there are: {}", file.path(), why, group, fmt::join(meshes, ", ")));
}

}  // namespace

bool IsOpenPmd(AttributedFile& file) { return file.Text("/", "openPMD").has_value(); }

Result<Pyramid> ReadOpenPmd(AttributedFile& file, const ReadOptions& options, const SourceContext& context) {
  const Result<Iterations> iterations = IterationsOf(file);
  if (!iterations.ok()) return iterations.status();
  const Result<std::int64_t> time = ChosenVolume(file.path(), iterations->times.count, options);
  if (!time.ok()) return time.status();
  std::string meshes = file.Text("/", "meshesPath").value_or("fields/");
  while (meshes.ends_with('/')) meshes.pop_back();
  const Result<PmdMesh> mesh = ChosenMesh(file, fmt::format("/data/{}/{}", iterations->names[std::size_t(*time)], meshes), options);
  if (!mesh.ok()) return mesh.status();
  const Result<int> channel = mesh->channels.empty() ? Result(0) : ChosenChannel(file.path(), mesh->channels, options);
  if (!channel.ok()) return channel.status();
  ReadOptions of_dataset = options;
  of_dataset.time.reset();
  if (!mesh->channels.empty()) of_dataset.channel.reset();
  of_dataset.dataset = mesh->paths[std::size_t(*channel)];
  Result<Pyramid> pyramid = ReadImage(file, of_dataset, context);
  if (!pyramid.ok()) return pyramid;
  pyramid->info.times = iterations->times;
  pyramid->info.time = int(*time);
  pyramid->info.channels = mesh->channels;
  pyramid->info.channel = *channel;
  return pyramid;
}

ImageLayout OpenPmdMesh() {
  return {[](AttributedFile&) { return Result(std::vector<std::string>()); }, Describe};
}

}  // namespace slabstream
