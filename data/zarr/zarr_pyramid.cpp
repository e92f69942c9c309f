#include "data/zarr/zarr_pyramid.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

#include "common/base/printable.h"
#include "common/text/url.h"
#include "data/volume_io/length_names.h"
#include "data/zarr/consolidated_store.h"
#include "data/zarr/find_volume.h"
#include "data/zarr/ome.h"
#include "data/zarr/plain_array.h"
#include "data/zarr/world_attributes.h"
#include "data/zarr/zarr_array.h"

namespace slabstream::zarr {
namespace {

using metadata::Join;

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
      const double finest = common.factor[axis] * image.levels.front().place.scale[number];
      // Before 0.4 the sizes alone say it.
      const double shrunk = !image.scaled && there ? double(sizes.front()[number]) / double(sizes[i][number]) : 1;
      level.spacing[axis] = there ? common.factor[axis] * image.levels[i].place.scale[number] * shrunk : finest;
      level.origin[axis] = there ? common.factor[axis] * image.levels[i].place.translation[number] : 0;
      if (!image.translated) level.origin[axis] += (level.spacing[axis] - finest) / 2;
    }
  }
}

Result<Pyramid> PyramidOfImage(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options, std::set<std::string>& keys) {
  const std::string name = NameOf(*context.store, node.path);
  const Result<OmeImage> image = ParseOmeImage(node.attributes_field());
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
  info = {.format = "OME-Zarr " + Printable(image->version),
          .labels = image->labels,
          .looks = image->looks,
          .channel = choice.channel,
          .times = choice.times,
          .time = choice.time,
          .notes = image->notes};
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

Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& opened, const ReadOptions& options, const SourceContext& context) {
  // Requests take long. In folders the nodes themselves are never behind the times.
  const std::shared_ptr<Store> store = IsUrl(opened->name()) ? WithConsolidatedMetadata(opened) : opened;
  Result<FoundVolume> found = FindVolume(*store, options.array);
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
