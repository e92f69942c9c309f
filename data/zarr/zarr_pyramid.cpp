#include "data/zarr/zarr_pyramid.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "common/base/printable.h"
#include "data/sources/axis_choice.h"
#include "data/volume_io/length_names.h"
#include "data/zarr/ome.h"
#include "data/zarr/world_attributes.h"
#include "data/zarr/zarr_array.h"
#include "data/zarr/zarr_node.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;
using metadata::Join;

std::string NameOf(const Store& store, const std::string& path) { return path.empty() ? store.name() : store.name() + "/" + path; }

// The node that a volume is read from, and the objects that were read to find it.
struct Found {
  ZarrNode node;
  std::set<std::string> keys;
};

Result<ZarrNode> NodeOf(const Store& store, NodeReading reading, std::set<std::string>& keys) {
  Result<std::optional<ZarrNode>> node = reading.Get();
  if (!node.ok()) return node.status();
  if (!node->has_value()) return Printable(Status::NotFound(NameOf(store, reading.path()) + ": no Zarr array or group is there"));
  keys.insert((*node)->keys.begin(), (*node)->keys.end());
  return **std::move(node);
}

// The path of the only array in a group. InvalidArgument, naming what there is: none, or several.
Result<std::string> OnlyArray(Store& store, const std::string& path) {
  const Result<std::vector<std::string>> names = store.List(path);
  if (!names.ok()) return names.status();
  constexpr std::size_t kMostLooked = 1000, kMostTold = 20;
  std::vector<std::string> arrays, groups;
  std::size_t looked = 0;
  for (const std::string& name : *names) {
    if (!name.ends_with('/') || name.starts_with('.') || ++looked > kMostLooked) continue;
    const std::string child = name.substr(0, name.size() - 1);
    const Result<std::optional<ZarrNode>> node = NodeReading(store, Join(path, child)).Get();
    if (node.ok() && node->has_value()) ((*node)->array ? arrays : groups).push_back(child);
  }
  if (arrays.size() == 1) return Join(path, arrays.front());
  const std::vector<std::string>& told = arrays.empty() ? groups : arrays;
  std::string list;
  for (std::size_t i = 0; i < std::min(told.size(), kMostTold); ++i) list += (i > 0 ? ", " : "") + Join(path, told[i]);
  if (told.size() > kMostTold) list += ", ...";
  std::string why = "a group without arrays";
  if (!arrays.empty()) why = fmt::format("a group of {} arrays, of which ?array= takes one: {}", arrays.size(), list);
  if (arrays.empty() && !groups.empty()) why += ", but with groups, of which ?array= takes one: " + list;
  return Printable(Status::InvalidArgument(NameOf(store, path) + ": " + why));
}

// bioformats2raw writes one image or more as 0, 1, ... into a group.
bool IsImageSeries(const ZarrNode& node) {
  const Field attributes = node.attributes_field();
  return (node.version == 3 ? attributes["ome"] : attributes)["bioformats2raw.layout"].given();
}

Result<Found> FindVolume(Store& store, std::string path) {
  Found found;
  constexpr int kMostSteps = 4;
  for (int step = 0; step < kMostSteps; ++step) {
    Result<ZarrNode> node = NodeOf(store, NodeReading(store, path), found.keys);
    if (!node.ok()) return node.status();
    if (node->array || IsOmeImage(node->attributes_field(), node->version)) {
      found.node = *std::move(node);
      return found;
    }
    const Result<std::string> below = IsImageSeries(*node) ? Join(path, "0") : OnlyArray(store, path);
    if (!below.ok()) return below.status();
    path = *below;
  }
  return Status::InvalidArgument(NameOf(store, path) + ": too many groups in groups");
}

template <class T>
std::vector<T> InOrderOf(const std::vector<std::size_t>& from, const std::vector<T>& of_metadata) {
  std::vector<T> ordered;
  for (const std::size_t axis : from) ordered.push_back(of_metadata[axis]);
  return ordered;
}

std::vector<std::uint64_t> SizesInMetadata(const ZarrArray& array) {
  std::vector<std::uint64_t> sizes(array.from.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) sizes[array.from[i]] = array.array->shape().size[i];
  return sizes;
}

// A level of the axes of the metadata, as those of the array.
PyramidLevel LevelOf(const ZarrArray& array, const AxisChoice& choice) {
  PyramidLevel level{.array = array.array, .at = InOrderOf(array.from, choice.at)};
  for (std::size_t i = 0; i < level.axes.size(); ++i) {
    const auto place = std::ranges::find(array.from, std::size_t(choice.axes[i]));
    level.axes[i] = choice.axes[i] < 0 ? -1 : int(place - array.from.begin());
  }
  return level;
}

// Names of all axes of the metadata, "" where there is none.
Result<std::vector<std::string>> NamesOfAxes(const ZarrArray& array, const ZarrNode& node) {
  std::vector<std::string> names(array.from.size());
  for (std::size_t i = 0; i < array.dimension_names.size(); ++i) names[array.from[i]] = array.dimension_names[i];
  const Field xarray = node.attributes_field()["_ARRAY_DIMENSIONS"];
  if (!array.dimension_names.empty() || !xarray.given()) return names;
  if (!xarray.is_array() || xarray.size() != names.size()) return xarray.Wrong(fmt::format("a list of {} names", names.size()));
  for (std::size_t axis = 0; axis < names.size(); ++axis) {
    const Result<std::string> name = xarray[axis].Text();
    if (!name.ok()) return name.status();
    names[axis] = *name;
  }
  return names;
}

Result<Pyramid> PyramidOfArray(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options) {
  const std::string name = NameOf(*context.store, node.path);
  const Result<ZarrArray> array = OpenArray(context, node);
  if (!array.ok()) return array.status();
  const Result<std::vector<std::string>> names = NamesOfAxes(*array, node);
  if (!names.ok()) return names.status();
  const Result<std::vector<AxisKind>> kinds = KindsOfPlainAxes(name, *names, options);
  if (!kinds.ok()) return kinds.status();
  const Result<AxisChoice> choice = ChooseAxes(name, *kinds, SizesInMetadata(*array), options);
  if (!choice.ok()) return choice.status();
  Pyramid pyramid;
  pyramid.info = {.format = fmt::format("Zarr {}", node.version), .times = choice->times};
  if (choice->channels > 1) pyramid.info.channels.resize(std::size_t(choice->channels));
  pyramid.info.channel = choice->channel;
  pyramid.levels.push_back(LevelOf(*array, *choice));
  if (options.spacing) pyramid.levels.back().spacing = *options.spacing;
  return pyramid;
}

// The unit of x, if y and z state one as well, and by what theirs differ from it.
struct CommonUnit {
  std::optional<LengthUnit> unit;
  Vec3 factor = {1, 1, 1};
};
CommonUnit UnitOf(const OmeImage& image, const AxisChoice& choice) {
  CommonUnit common{image.axes[std::size_t(choice.axes[0])].unit};
  for (const Axis axis : kAxes) {
    const int number = choice.axes[std::size_t(axis)];
    if (number < 0) continue;
    const std::optional<LengthUnit> unit = image.axes[std::size_t(number)].unit;
    if (!unit || !common.unit) return {};
    if (unit != common.unit) common.factor[axis] = MetresIn(*unit) / MetresIn(*common.unit);
  }
  return common;
}

// Where the voxels of the levels are.
void PlaceLevels(const OmeImage& image, const AxisChoice& choice, const std::vector<std::vector<std::uint64_t>>& sizes, Pyramid& pyramid) {
  const CommonUnit common = UnitOf(image, choice);
  pyramid.orientation.unit = common.unit;
  for (std::size_t i = 0; i < image.levels.size(); ++i) {
    PyramidLevel& level = pyramid.levels[i];
    for (const Axis axis : kAxes) {
      const auto number = std::size_t(choice.axes[std::size_t(axis)] < 0 ? choice.axes[0] : choice.axes[std::size_t(axis)]);
      const bool there = choice.axes[std::size_t(axis)] >= 0;
      const double finest = common.factor[axis] * image.levels.front().scale[number];
      // Before 0.4 the sizes alone say it.
      const double shrunk = !image.scaled && there ? double(sizes.front()[number]) / double(sizes[i][number]) : 1;
      level.spacing[axis] = there ? common.factor[axis] * image.levels[i].scale[number] * shrunk : finest;
      level.origin[axis] = there ? common.factor[axis] * image.levels[i].translation[number] : 0;
      if (!image.translated) level.origin[axis] += (level.spacing[axis] - finest) / 2;
    }
  }
}

Result<Pyramid> PyramidOfImage(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options, std::set<std::string>& keys) {
  const std::string name = NameOf(*context.store, node.path);
  const Result<OmeImage> image = ParseOmeImage(node.attributes_field(), node.version);
  if (!image.ok()) return image.status();
  if (options.spacing) return Status::InvalidArgument(name + ": states its spacing, so it takes no option spacing");
  std::vector<AxisKind> kinds;
  for (const OmeAxis& axis : image->axes) kinds.push_back(axis.kind);
  std::vector<std::string> names;
  for (const OmeChannel& channel : image->channels) names.push_back(channel.name);

  Pyramid pyramid;
  AxisChoice choice;
  std::vector<std::vector<std::uint64_t>> sizes;
  std::vector<NodeReading> arrays;
  for (const OmeLevel& level : image->levels) arrays.emplace_back(*context.store, Join(node.path, level.path));
  for (NodeReading& reading : arrays) {
    const std::string array_name = NameOf(*context.store, reading.path());
    const Result<ZarrNode> array_node = NodeOf(*context.store, std::move(reading), keys);
    if (!array_node.ok()) return array_node.status();
    if (!array_node->array) return Status::InvalidArgument(array_name + ": is a group, must be an array");
    const Result<ZarrArray> array = OpenArray(context, *array_node);
    if (!array.ok()) return array.status();
    sizes.push_back(SizesInMetadata(*array));
    if (sizes.back().size() != kinds.size()) {
      return Status::InvalidArgument(
          fmt::format("{}: has {} axes, must have {} as its image", array_name, sizes.back().size(), kinds.size()));
    }
    const Result<AxisChoice> chosen = ChooseAxes(array_name, kinds, sizes.back(), options, names);
    if (!chosen.ok()) return chosen.status();
    if (sizes.size() == 1) choice = *chosen;
    pyramid.levels.push_back(LevelOf(*array, *chosen));
  }
  PlaceLevels(*image, choice, sizes, pyramid);
  if (Status status = PlaceInWorld(node.attributes_field()["slabstream"], pyramid); !status.ok()) return status;

  SourceInfo& info = pyramid.info;
  info = {.format = "OME-Zarr " + image->version, .labels = image->labels, .channel = choice.channel, .times = choice.times};
  const auto channel = std::size_t(choice.channel);
  const bool described = channel < image->channels.size();
  if (choice.channels > 1 || (described && !names.front().empty())) {
    info.channels = names;
    info.channels.resize(std::size_t(choice.channels));
  }
  if (described) info.window = image->channels[channel].window;
  return pyramid;
}

std::vector<std::string> FilesOf(const Store& store, const std::set<std::string>& keys) {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::absolute(store.name(), error);
  if (!std::filesystem::is_directory(root, error)) return {root.string()};
  std::vector<std::string> files;
  for (const std::string& key : keys) files.push_back((root / key).string());
  return files;
}

}  // namespace

Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context) {
  Result<Found> found = FindVolume(*store, options.array);
  if (!found.ok()) return found.status();
  const ArrayContext arrays = MakeArrayContext(store, context);
  Result<Pyramid> pyramid =
      found->node.array ? PyramidOfArray(arrays, found->node, options) : PyramidOfImage(arrays, found->node, options, found->keys);
  if (pyramid.ok()) {
    pyramid->info.files = FilesOf(*store, found->keys);
    pyramid->info.folder = store->name();
  }
  return pyramid;
}

}  // namespace slabstream::zarr
