// Zarr, versions 2 and 3, in folders and zip archives: OME-Zarr images with their levels, and plain arrays.
//
//   scan.ome.zarr      scan.ome.zarr/labels/cells      scan.ozx?array=labels/cells      simulation.zarr?array=density,time=3
#include "data/zarr/zarr_pyramid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "common/text/url.h"
#include "data/metadata/open_store_for.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/stated_field.h"
#include "data/zarr/consolidated_store.h"
#include "data/zarr/find_volume.h"
#include "data/zarr/ome.h"
#include "data/zarr/plain_array.h"
#include "data/zarr/zarr_array.h"
#include "data/zarr/zarr_node.h"

namespace slabstream {
namespace zarr {
namespace {

using metadata::Field;
using metadata::Join;

bool IsArchive(const std::string& path) { return path.ends_with(".zip") || path.ends_with(".ozx"); }

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  const auto is_there = [&](std::string_view name) { return std::filesystem::is_regular_file(std::filesystem::path(path) / name, error); };
  if (std::filesystem::is_directory(path, error)) return std::ranges::any_of(kNodeObjects, is_there);
  if (!IsArchive(path)) return false;
  const Result<std::shared_ptr<Store>> archive = ZipStore(path);
  const Result<std::vector<std::string>> names = archive.ok() ? (*archive)->List("") : archive.status();
  const auto has = [&](std::string_view name) { return std::ranges::find(*names, name) != names->end(); };
  return names.ok() && std::ranges::any_of(kNodeObjects, has);
}

// The unit of x, if y and z state one as well, and by what theirs differ from it.
struct CommonUnit {
  std::optional<LengthUnit> unit;
  Vec3 factor = {1, 1, 1};
};
CommonUnit UnitOf(const OmeImage& image, const ChosenAxes& choice) {
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
void PlaceLevels(const OmeImage& image, const ChosenAxes& choice, const std::vector<std::vector<std::uint64_t>>& sizes, Pyramid& pyramid) {
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

Result<Vec3> ReadVector(const Field& field) {
  if (!field.is_array() || field.size() != 3) return field.Wrong("a list of 3 numbers");
  Vec3 vector;
  for (int i = 0; i < 3; ++i) {
    const Result<double> number = field[std::size_t(i)].Number();
    if (!number.ok()) return number.status();
    vector[i] = *number;
  }
  return vector;
}

bool AreRightHanded(const std::array<Vec3, 3>& axes) {
  constexpr double kTolerance = 1e-6;
  const auto near = [](double value, double expected) { return std::abs(value - expected) <= kTolerance; };
  for (std::size_t i = 0; i < 3; ++i) {
    if (!near(Dot(axes[i], axes[i]), 1) || !near(Dot(axes[i], axes[(i + 1) % 3]), 0)) return false;
  }
  return Dot(Cross(axes[0], axes[1]), axes[2]) > 0;
}

// What `slabstream convert` keeps of a volume in attributes of its own, since OME-Zarr has no place for it: the world, its axes, and the
// mapping to data values. data/zarr_writer/ome_metadata.h says what they are.
//
// `own`: the attribute "slabstream" of an image; not stated: nothing changes. `pyramid`: its origins are positions in the coordinate system
// of the image; they become positions in the world. InvalidArgument, naming the field: it is wrong.
Status PlaceInWorld(const Field& own, Pyramid& pyramid) {
  if (const Field place = own["orientation"]; place.given()) {
    const Result<std::string> name = place["world"].Text();
    if (!name.ok()) return name.status();
    static constexpr std::array kWorlds = {World::kVoxels, World::kScene, World::kPatient};
    const auto* const world = std::ranges::find(kWorlds, *name, [](World each) { return NameOf(each); });
    if (world == kWorlds.end()) return place["world"].Wrong("voxels, scene or patient");
    const Result<Vec3> origin = ReadVector(place["origin"]);
    if (!origin.ok()) return origin.status();
    std::array<Vec3, 3> axes;
    for (std::size_t i = 0; i < 3; ++i) {
      const Result<Vec3> axis = ReadVector(place["axes"][i]);
      if (!axis.ok()) return axis.status();
      axes[i] = *axis;
    }
    if (!AreRightHanded(axes)) return place["axes"].Wrong("3 unit vectors at right angles, right-handed");
    pyramid.orientation.world = *world;
    pyramid.orientation.axes = axes;
    for (PyramidLevel& level : pyramid.levels) level.origin = *origin + pyramid.orientation.ToWorld(level.origin);
  }
  if (const Field values = own["values"]; values.given()) {
    const Result<double> scale = values["scale"].Number(), offset = values["offset"].Number();
    if (!scale.ok()) return scale.status();
    if (!offset.ok()) return offset.status();
    if (*scale == 0) return values["scale"].Wrong("a number other than 0");
    pyramid.rescale = {*scale, *offset};
  }
  return Status::Ok();
}

Result<Pyramid> PyramidOfImage(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options, std::set<std::string>& keys) {
  const std::string name = NameOf(*context.store, node.path);
  const Result<OmeImage> image = ParseOmeImage(node.attributes_field());
  if (!image.ok()) return image.status();
  if (options.spacing) return Status::InvalidArgument(name + ": states its spacing, so it takes no option spacing");
  std::vector<AxisKind> kinds;
  for (const OmeAxis& axis : image->axes) kinds.push_back(axis.kind);

  Pyramid pyramid;
  ChosenAxes choice;
  std::vector<std::vector<std::uint64_t>> sizes;
  std::string finest_key;
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
    const Result<ChosenAxes> chosen = ChooseAxes(array_name, kinds, sizes.back(), options, image->channels);
    if (!chosen.ok()) return chosen.status();
    if (sizes.size() == 1) {
      choice = *chosen;
      finest_key = array_node->keys.front();
    }
    pyramid.levels.push_back(LevelOf(*array, *chosen));
  }
  PlaceLevels(*image, choice, sizes, pyramid);
  if (Status status = PlaceInWorld(node.attributes_field()["slabstream"], pyramid); !status.ok()) return status;

  SourceInfo& info = pyramid.info;
  info = {.format = "OME-Zarr " + Printable(image->version), .labels = image->labels, .looks = image->looks, .notes = image->notes};
  choice.Describe(info);
  for (FieldInfo& channel : info.channels) {
    if (channel.window) channel.window = StatedWindow(channel.window->min, channel.window->max, pyramid.rescale);
  }
  if (const auto time = std::ranges::find(kinds, AxisKind::kTime); time != kinds.end() && image->scaled) {
    const auto axis = std::size_t(time - kinds.begin());
    info.times = StatedTimes(choice.times, image->levels.front().place.scale[axis], image->axes[axis].time_unit);
  }
  FollowTimes(context.store, finest_key, options, pyramid);
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
    if (found->node.array) FollowTimes(store, found->node.keys.front(), options, *pyramid);
    pyramid->info.files = FilesOf(*store, found->keys);
    pyramid->info.folder = store->name();
  }
  return pyramid;
}

}  // namespace zarr

VolumeFormat Zarr() {
  return {.name = "Zarr",
          .recognises = zarr::Recognises,
          .options = {"time", "channel", "spacing", "array", "resample", "follow-links"},
          .markers = {zarr::kNodeObjects.begin(), zarr::kNodeObjects.end()},
          .open = OpenInStore<zarr::OpenPyramid>};
}

}  // namespace slabstream
