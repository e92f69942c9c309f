// What a container holds: views as BigStitcher writes them (setupS/timepointT/sL), a group of levels (s0, s1, ...), or datasets. Sources:
// https://github.com/saalfeldlab/n5-viewer#metadata, https://github.com/bigdataviewer/bigdataviewer-core (N5ImageLoader)
#include "data/n5/n5_pyramid.h"
#include "data/volume_io/chosen_channel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "common/base/natural_order.h"
#include "common/base/parse_number.h"
#include "common/base/printable.h"
#include "data/n5/n5_array.h"
#include "data/sources/space_axes.h"
#include "data/sources/view_setups.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream::n5 {
namespace {

using metadata::Field;
using metadata::Join;
using metadata::Json;

// Attributes of a group or a dataset; none is a group without any.
struct Node {
  std::string path;
  std::string object;  // "/data/scan.n5/s0/attributes.json"
  Json attributes;

  Field field() const { return {object, attributes}; }
  bool is_array() const { return field()["dimensions"].given(); }
};

class Container {
 public:
  Container(std::shared_ptr<Store> store, const ReadOptions& options, const SourceContext& context)
      : store_(std::move(store)), options_(options), context_(context) {}

  Result<Pyramid> Open();

 private:
  std::string NameOf(const std::string& path) const { return path.empty() ? store_->name() : store_->name() + "/" + path; }
  Status Refused(const std::string& path, const std::string& why) const {
    return Printable(Status::InvalidArgument(NameOf(path) + ": " + why));
  }

  Result<Node> Read(const std::string& path);
  Result<bool> IsArray(const std::string& path);
  // Names of folders in a folder, in natural order.
  Result<std::vector<std::string>> Folders(const std::string& path);

  Result<Pyramid> Views();
  // The datasets s0, s1, ... in a group. `above`: the group that it lies in. `setup`: what the XML file says of it.
  Result<Pyramid> Levels(const Node& group, const Node& above, const ViewSetup& setup, const ReadOptions& options);
  Result<Pyramid> Single(const Node& array);
  Result<Pyramid> At(const std::string& path);
  // The only one of these folders that holds a volume. InvalidArgument, naming what there is: none, or several.
  Result<std::string> OnlyVolume(const std::vector<std::string>& folders);

  const std::shared_ptr<Store> store_;
  const ReadOptions& options_;
  const SourceContext& context_;
  std::vector<std::string> files_;
};

// PREFIX and a number: "setup0".
std::vector<std::string> Numbered(const std::vector<std::string>& names, std::string_view prefix) {
  std::vector<std::string> found;
  for (const std::string& name : names) {
    if (name.starts_with(prefix) && ParseNumber<int>(std::string_view(name).substr(prefix.size())).value_or(-1) >= 0) found.push_back(name);
  }
  return found;
}

// The numbers of a list: x, y and z first.
std::optional<Vec3> Triple(const Field& list) {
  if (!list.is_array() || list.size() < 3) return std::nullopt;
  Vec3 triple;
  for (int axis = 0; axis < 3; ++axis) {
    const Result<double> number = list[std::size_t(axis)].Number();
    if (!number.ok() || !(*number > 0)) return std::nullopt;
    triple[axis] = *number;
  }
  return triple;
}

struct Spacing {
  Vec3 spacing = {1, 1, 1};
  std::optional<LengthUnit> unit = {};
};

// "pixelResolution": {"unit": "um", "dimensions": [x, y, z]}, or a list; or "resolution": [x, y, z] and "units": ["nm", ...].
std::optional<Spacing> SpacingOf(const Field& attributes) {
  const Field pixel = attributes["pixelResolution"], unit = pixel["unit"], units = attributes["units"];
  if (const auto spacing = Triple(pixel.is_array() ? pixel : pixel["dimensions"])) {
    return Spacing{*spacing, unit.is_text() ? LengthUnitNamed(unit.Text().value()) : std::nullopt};
  }
  const auto spacing = Triple(attributes["resolution"]);
  if (!spacing) return std::nullopt;
  const Field first = units[std::size_t{0}];
  return Spacing{*spacing, first.is_text() ? LengthUnitNamed(first.Text().value()) : std::nullopt};
}

Result<Node> Container::Read(const std::string& path) {
  const std::string key = Join(path, kAttributes);
  Node node{.path = path, .object = store_->name() + "/" + key};
  Result<std::optional<Json>> json = metadata::ReadJson(*store_, key);
  if (!json.ok()) return json.status();
  if (!json->has_value()) return node;
  node.attributes = **std::move(json);
  if (!node.attributes.is_object()) return node.field().Wrong("an object");
  files_.push_back(node.object);
  return node;
}

Result<std::vector<std::string>> Container::Folders(const std::string& path) {
  const Result<std::vector<std::string>> names = store_->List(path);
  if (!names.ok()) return names.status();
  std::vector<std::string> folders;
  for (const std::string& name : *names) {
    if (name.ends_with('/')) folders.push_back(name.substr(0, name.size() - 1));
  }
  std::ranges::sort(folders, {}, InNaturalOrder);
  return folders;
}

// How many voxels of the finest level one of this level stands for: as its own attributes say, else those of its group or the one above,
// else by the sizes.
Vec3 FactorsOf(std::size_t level, const Node& own, const Node& group, const Node& above, const std::vector<std::uint64_t>& finest,
               const std::vector<std::uint64_t>& size) {
  if (const auto factors = Triple(own.field()["downsamplingFactors"])) return *factors;
  for (const Node* const node : {&group, &above}) {
    for (const char* const name : {"downsamplingFactors", "scales"}) {
      if (const auto factors = Triple(node->field()[name][level])) return *factors;
    }
  }
  Vec3 factors = {1, 1, 1};
  for (std::size_t axis = 0; axis < 3 && axis < size.size(); ++axis) {
    const std::size_t at = size.size() - 1 - axis;
    factors[int(axis)] = double(finest[at]) / double(size[at]);
  }
  return factors;
}

Result<Pyramid> Container::Levels(const Node& group, const Node& above, const ViewSetup& setup, const ReadOptions& options) {
  Pyramid pyramid{.info = {.format = "N5"}};
  std::optional<Spacing> spacing = SpacingOf(group.field());
  if (setup.spacing) spacing = Spacing{*setup.spacing, setup.unit};
  const Result<std::vector<std::string>> folders = Folders(group.path);
  if (!folders.ok()) return folders.status();
  std::vector<std::uint64_t> finest;
  for (const std::string& folder : Numbered(*folders, "s")) {
    const std::string path = Join(group.path, folder);
    if (folder != "s" + std::to_string(pyramid.levels.size()))
      return Refused(path, fmt::format("level s{} is missing", pyramid.levels.size()));
    const Result<Node> node = Read(path);
    if (!node.ok()) return node.status();
    if (!node->is_array()) return Refused(path, "must be a dataset, but has no dimensions");
    const Result<std::shared_ptr<ChunkedArray>> array = OpenArray(store_, path, node->field(), context_);
    if (!array.ok()) return array.status();
    const std::vector<std::uint64_t>& size = (*array)->shape().size;
    if (finest.empty()) finest = size;
    if (size.size() != finest.size()) return Refused(path, fmt::format("has {} axes, s0 has {}", size.size(), finest.size()));
    const Result<SpaceAxes> space = LastAxesAreSpace(NameOf(path), size, options);
    if (!space.ok()) return space.status();
    if (!spacing) spacing = SpacingOf(node->field());
    const Vec3 base = spacing.value_or(Spacing{}).spacing;
    const Vec3 factors = FactorsOf(pyramid.levels.size(), *node, group, above, finest, size);
    pyramid.info.times = space->times;
    pyramid.levels.push_back({.array = *array,
                              .axes = space->axes,
                              .at = space->at,
                              .spacing = factors * base,
                              .origin = 0.5 * (factors - Vec3{1, 1, 1}) * base});  // the mean of the voxels that it stands for
    if (spacing) pyramid.orientation.unit = spacing->unit;
  }
  return pyramid;
}

Result<Pyramid> Container::Views() {
  const Result<std::vector<std::string>> folders = Folders("");
  if (!folders.ok()) return folders.status();
  const std::vector<std::string> setups = Numbered(*folders, "setup");
  const Result<ViewSetupFile> xml = ReadViewSetupsBeside(store_->name());
  if (!xml.ok()) return xml.status();
  if (!xml->path.empty()) files_.push_back(xml->path);
  constexpr std::size_t kPrefix = 5;  // of "setup"
  const auto setup_of = [&](const std::string& name) {
    const auto found = std::ranges::find(xml->setups, ParseNumber<int>(name.substr(kPrefix)).value_or(-1), &ViewSetup::id);
    return found == xml->setups.end() ? ViewSetup{} : *found;
  };
  std::vector<std::string> channels;
  for (const std::string& name : setups) channels.push_back(setup_of(name).name);
  const Result<int> channel = ChosenChannel(store_->name(), channels, options_);
  if (!channel.ok()) return channel.status();
  const std::string& setup = setups[std::size_t(*channel)];

  const Result<std::vector<std::string>> of_setup = Folders(setup);
  if (!of_setup.ok()) return of_setup.status();
  const std::vector<std::string> times = Numbered(*of_setup, "timepoint");
  if (times.empty()) return Refused(setup, "has no timepoint");
  const Result<std::int64_t> time = ChosenVolume(NameOf(setup), std::int64_t(times.size()), options_);
  if (!time.ok()) return time.status();
  const Result<Node> above = Read(setup), group = Read(Join(setup, times[std::size_t(*time)]));
  if (!above.ok()) return above.status();
  if (!group.ok()) return group.status();
  Result<Pyramid> pyramid = Levels(*group, *above, setup_of(setup), {});  // each level is of one channel and one time
  if (!pyramid.ok()) return pyramid;
  pyramid->info.format = "BigDataViewer N5";
  pyramid->info.times = int(times.size());
  pyramid->info.channels = channels;
  pyramid->info.channel = *channel;
  return pyramid;
}

Result<Pyramid> Container::Single(const Node& array) {
  const Result<std::shared_ptr<ChunkedArray>> opened = OpenArray(store_, array.path, array.field(), context_);
  if (!opened.ok()) return opened.status();
  const Result<SpaceAxes> space = LastAxesAreSpace(NameOf(array.path), (*opened)->shape().size, options_);
  if (!space.ok()) return space.status();
  const std::optional<Spacing> spacing = SpacingOf(array.field());
  Pyramid pyramid{.info = {.format = "N5", .times = space->times}};
  pyramid.levels.push_back({.array = *opened, .axes = space->axes, .at = space->at, .spacing = spacing.value_or(Spacing{}).spacing});
  if (spacing) pyramid.orientation.unit = spacing->unit;
  return pyramid;
}

Result<bool> Container::IsArray(const std::string& path) {
  const Result<Node> node = Read(path);
  if (!node.ok()) return node.status();
  return node->is_array();
}

Result<std::string> Container::OnlyVolume(const std::vector<std::string>& folders) {
  constexpr std::size_t kMostLooked = 1000, kMostTold = 20;
  std::vector<std::string> found;
  for (std::size_t i = 0; i < std::min(folders.size(), kMostLooked); ++i) {
    const Result<bool> array = IsArray(folders[i]), levels = IsArray(Join(folders[i], "s0"));
    if ((array.ok() && *array) || (levels.ok() && *levels)) found.push_back(folders[i]);
  }
  if (found.size() == 1) return found[0];
  const std::vector<std::string>& told = found.empty() ? folders : found;
  std::string list;
  for (std::size_t i = 0; i < std::min(told.size(), kMostTold); ++i) list += (i > 0 ? ", " : "") + told[i];
  if (told.size() > kMostTold) list += ", ...";
  if (!found.empty()) return Refused("", fmt::format("holds {} volumes, of which ?array= takes one: {}", found.size(), list));
  return Refused("", list.empty() ? "holds no dataset" : "holds no dataset itself; ?array= takes the path of one below: " + list);
}

Result<Pyramid> Container::At(const std::string& path) {
  const Result<Node> node = Read(path);
  if (!node.ok()) return node.status();
  if (node->is_array()) return Single(*node);
  const Result<bool> levels = IsArray(Join(path, "s0"));
  if (!levels.ok()) return levels.status();
  if (!*levels) return Refused(path, "is no dataset, and no group of levels: neither it nor s0 in it has dimensions");
  const Result<Node> above = Read(path.substr(0, path.find_last_of('/') == std::string::npos ? 0 : path.find_last_of('/')));
  if (!above.ok()) return above.status();
  return Levels(*node, *above, {}, options_);
}

Result<Pyramid> Container::Open() {
  const auto open = [&]() -> Result<Pyramid> {
    if (!options_.array.empty()) return At(options_.array);
    const Result<bool> array = IsArray(""), levels = IsArray("s0");
    if (!array.ok()) return array.status();
    if (*array || (levels.ok() && *levels)) return At("");
    const Result<std::vector<std::string>> folders = Folders("");
    if (!folders.ok()) return folders.status();
    if (!Numbered(*folders, "setup").empty()) return Views();
    const Result<std::string> only = OnlyVolume(*folders);
    return only.ok() ? At(*only) : only.status();
  };
  Result<Pyramid> pyramid = open();
  if (pyramid.ok()) {
    std::ranges::sort(files_);
    files_.erase(std::unique(files_.begin(), files_.end()), files_.end());
    pyramid->info.files = files_;
    pyramid->info.folder = store_->name();
  }
  return pyramid;
}

}  // namespace

Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context) {
  return Container(store, options, context).Open();
}

}  // namespace slabstream::n5
