// What a container holds: views as BigStitcher writes them (setupS/timepointT/sL), a group of levels (s0, s1, ...),
// channels of these (c0, c1, ...), or datasets. Sources:
// https://github.com/saalfeldlab/n5-viewer#metadata, https://github.com/bigdataviewer/bigdataviewer-core (N5ImageLoader)
#include "data/n5/n5_pyramid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <utility>

#include "common/base/printable.h"
#include "common/text/natural_order.h"
#include "data/metadata/open_store_for.h"
#include "data/n5/n5_array.h"
#include "data/n5/n5_place.h"
#include "data/sources/axis_choice.h"
#include "data/sources/view_setups.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {
namespace n5 {
namespace {

using metadata::Field;
using metadata::Join;

constexpr const char* kAttributes = "attributes.json";
constexpr std::size_t kMostLevels = 64;

bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) && (std::filesystem::path(path).extension() == ".n5" ||
                                                        std::filesystem::is_regular_file(std::filesystem::path(path) / kAttributes, error));
}

// Attributes of a group or a dataset; none is a group without any.
struct Node {
  std::string path;
  std::string object;  // "/data/scan.n5/s0/attributes.json"
  Json attributes;

  Field field() const { return {object, attributes}; }
  bool is_array() const { return field()["dimensions"].given(); }
};

// The numbers of a list: x, y and z first.
std::optional<Vec3> Factors(const Field& list) {
  if (!list.is_array() || list.size() < 3) return std::nullopt;
  Vec3 triple;
  for (int axis = 0; axis < 3; ++axis) {
    const Result<double> number = list[std::size_t(axis)].Number();
    if (!number.ok() || !(*number > 0)) return std::nullopt;
    triple[axis] = *number;
  }
  return triple;
}

// How many voxels of the finest level one of this level stands for: as its own attributes say, else those of its group or the one above,
// else by the sizes. `axes`: of the arrays, x, y and z.
Vec3 FactorsOf(std::size_t level, const Node& own, const Node& group, const Node& above, const std::vector<std::uint64_t>& finest,
               const std::vector<std::uint64_t>& size, const std::array<int, 3>& axes) {
  if (const auto factors = Factors(own.field()["downsamplingFactors"])) return *factors;
  for (const Node* const node : {&group, &above}) {
    for (const char* const name : {"downsamplingFactors", "scales"}) {
      if (const auto factors = Factors(node->field()[name][level])) return *factors;
    }
  }
  Vec3 factors = {1, 1, 1};
  for (int axis = 0; axis < 3; ++axis) {
    const int at = axes[std::size_t(axis)];
    if (at >= 0) factors[axis] = double(finest[std::size_t(at)]) / double(size[std::size_t(at)]);
  }
  return factors;
}

// The path and the attributes of a dataset of levels in `multiscales`; the path alone, if nothing lists them.
struct Listed {
  std::string path;
  Json attributes;
};
std::vector<Listed> ListedLevels(const Node& group) {
  std::vector<Listed> levels;
  const Field multiscale = group.field()["multiscales"][std::size_t{0}], datasets = multiscale["datasets"];
  for (std::size_t i = 0; datasets.is_array() && i < std::min(datasets.size(), kMostLevels); ++i) {
    const Field path = datasets[i]["path"];
    if (!path.is_text()) continue;
    levels.push_back({path.Text().value(), datasets[i].value()});
    // OME's names for the same.
    const Field steps = datasets[i]["coordinateTransformations"], axes = multiscale["axes"];
    Json transform = {{"axes", Json::array()}, {"units", Json::array()}};
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      for (const auto& [key, list] : {std::pair{"name", "axes"}, {"unit", "units"}}) {
        transform[list].push_back(axes[axis][key].given() ? axes[axis][key].value() : Json());
      }
    }
    for (std::size_t step = 0; steps.is_array() && step < steps.size(); ++step) {
      if (steps[step]["scale"].is_array()) transform["scale"] = steps[step]["scale"].value();
      if (steps[step]["translation"].is_array()) transform["translate"] = steps[step]["translation"].value();
    }
    if (transform.contains("scale")) levels.back().attributes["transform"] = std::move(transform);
  }
  return levels;
}

class Container {
 public:
  Container(std::shared_ptr<Store> store, const ReadOptions& options, const SourceContext& context)
      : store_(std::move(store)), options_(options), context_(context) {}

  Result<Pyramid> Open() {
    const auto open = [&]() -> Result<Pyramid> {
      if (!options_.array.empty()) return At(options_.array);
      const Result<std::optional<Pyramid>> found = Find("");
      if (!found.ok()) return found.status();
      if (*found) return **found;
      const Result<std::vector<std::string>> setups = FoldersOf("", "setup", "");
      if (setups.ok() && !setups->empty()) return Views();
      const Result<std::vector<std::string>> folders = Folders("");
      if (!folders.ok()) return folders.status();
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

 private:
  std::string NameOf(const std::string& path) const { return path.empty() ? store_->name() : store_->name() + "/" + path; }
  Status Refused(const std::string& path, const std::string& why) const {
    return Printable(Status::InvalidArgument(NameOf(path) + ": " + why));
  }

  Result<Node> Read(const std::string& path) {
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

  // Names of folders in a folder, in natural order.
  Result<std::vector<std::string>> Folders(const std::string& path) {
    const Result<std::vector<std::string>> names = store_->List(path);
    if (!names.ok()) return names.status();
    std::vector<std::string> folders;
    for (const std::string& name : *names) {
      if (name.ends_with('/')) folders.push_back(name.substr(0, name.size() - 1));
    }
    std::ranges::sort(folders, {}, InNaturalOrder);
    return folders;
  }

  Result<bool> HasLevels(const Node& group) { return ListedLevels(group).empty() ? IsArray(Join(group.path, "s0")) : Result(true); }

  // The datasets that `multiscales` lists in a group, else s0, s1, ... in it. `above`: the group that it lies in. `setup`: what the XML
  // file says of it.
  // The same way for a folder and an address, which cannot be listed: one level after the other is looked for.
  Result<Pyramid> Levels(const Node& group, const Node& above, const ViewSetup& setup, const ReadOptions& options) {
    Pyramid pyramid{.info = {.format = "N5"}};
    Result<std::optional<Place>> base = PlaceOf(group.field());
    if (!base.ok()) return base.status();
    if (setup.spacing) *base = Place{.spacing = *setup.spacing, .unit = setup.unit};
    std::vector<Listed> listed = ListedLevels(group);
    const std::size_t count = listed.empty() ? kMostLevels : listed.size();
    std::vector<std::uint64_t> finest;
    for (std::size_t level = 0; level < count; ++level) {
      const std::string path = Join(group.path, listed.empty() ? "s" + std::to_string(level) : listed[level].path);
      const Result<Node> node = Read(path);
      if (!node.ok()) return node.status();
      if (!node->is_array() && listed.empty()) break;
      if (!node->is_array()) return Refused(path, "must be a dataset, but has no dimensions");
      Result<std::optional<Place>> place = PlaceOf(node->field());
      if (!place.ok()) return place.status();
      if (!listed.empty() && !(*place && (*place)->of_level)) {  // what the group says of the level
        const Result<std::optional<Place>> of_group = PlaceOf(Field(group.object, listed[level].attributes));
        if (!of_group.ok()) return of_group.status();
        if (*of_group) place = of_group;
      }
      if (Status status = AddLevel(pyramid, *node, group, options); !status.ok()) return status;
      PyramidLevel& added = pyramid.levels.back();
      const std::vector<std::uint64_t>& size = added.array->shape().size;
      if (finest.empty()) finest = size;
      if (size.size() != finest.size()) return Refused(path, fmt::format("has {} axes, the first level {}", size.size(), finest.size()));
      if (!*base) base = place;
      if (*place && (*place)->of_level && !setup.spacing) {
        PutAt(pyramid, **place);
        continue;
      }
      const Place of_finest = base->value_or(Place{});
      const Vec3 factors = FactorsOf(level, *node, group, above, finest, size, added.axes);
      PutAt(pyramid, of_finest);
      added.spacing = factors * of_finest.spacing;
      added.origin = added.origin + 0.5 * (factors - Vec3{1, 1, 1}) * of_finest.spacing;  // the mean of the voxels that it stands for
    }
    return pyramid;
  }

  // Its place is still to be set.
  Status AddLevel(Pyramid& pyramid, const Node& node, const Node& group, const ReadOptions& options) {
    const Result<std::shared_ptr<ChunkedArray>> array = OpenArray(store_, node.path, node.field(), context_);
    if (!array.ok()) return array.status();
    const std::vector<std::uint64_t>& size = (*array)->shape().size;
    const Result<std::vector<std::string>> names = AxisNames(node.field(), group.field(), size);
    if (!names.ok()) return names.status();
    const Result<std::vector<AxisKind>> kinds = KindsOfPlainAxes(NameOf(node.path), *names, options);
    if (!kinds.ok()) return kinds.status();
    const Result<ChosenAxes> choice = ChooseAxes(NameOf(node.path), *kinds, size, options);
    if (!choice.ok()) return choice.status();
    pyramid.levels.push_back(
        {.array = *array, .axes = choice->axes, .at = choice->at, .time_axis = choice->time_axis, .channel_axis = choice->channel_axis});
    if (pyramid.levels.size() > 1) return Status::Ok();
    choice->Describe(pyramid.info);
    pyramid.info.times = TimesOf(node.field(), group.field(), choice->times);
    FollowTimes(store_, Join(node.path, kAttributes), options, pyramid);
    return Status::Ok();
  }

  // The last level.
  static void PutAt(Pyramid& pyramid, const Place& place) {
    PyramidLevel& level = pyramid.levels.back();
    level.spacing = place.spacing;
    level.origin = place.origin.value_or(Vec3{});
    pyramid.orientation.unit = place.unit;
    if (place.origin) pyramid.orientation.world = World::kScene;
    if (!place.attribute.empty()) pyramid.info.notes = {"spacing and origin are those of the attribute " + place.attribute};
  }

  // Names of folders that are PREFIX and a number, in the order of their numbers. `inside`: what has attributes in each of them, "": they
  // have.
  // Behind an address their number is found by halves.
  Result<std::vector<std::string>> FoldersOf(const std::string& path, const std::string& prefix, const std::string& inside) {
    const Result<std::vector<std::string>> folders = Folders(path);
    if (folders.ok()) return Numbered(*folders, prefix);
    const auto exists = [&](std::int64_t number) -> Result<bool> {
      const Result<Node> node = Read(Join(path, prefix + std::to_string(number) + inside));
      return node.ok() ? Result(!node->attributes.is_null()) : node.status();
    };
    std::int64_t there = 0, end = kMaxVolumes;  // those below `there` are there, `end` is not
    while (there < end) {
      const std::int64_t number = end == kMaxVolumes ? std::min(2 * there, end - 1) : there + (end - there) / 2;
      const Result<bool> found = exists(number);
      if (!found.ok()) return found.status();
      (*found ? there : end) = *found ? number + 1 : number;
    }
    std::vector<std::string> names;
    for (std::int64_t i = 0; i < there; ++i) names.push_back(prefix + std::to_string(i));
    return names;
  }

  Result<Pyramid> Views() {
    const Result<std::vector<std::string>> setups = FoldersOf("", "setup", "");
    if (!setups.ok()) return setups.status();
    const Result<ViewSetupFile> xml = ReadViewSetupsBeside(store_->name());
    if (!xml.ok()) return xml.status();
    files_.insert(files_.end(), xml->files.begin(), xml->files.end());
    std::vector<FieldInfo> channels;
    for (const std::string& name : *setups) channels.push_back(xml->Of(name, "setup").channel);
    const Result<int> channel = ChosenChannel(store_->name(), channels, options_);
    if (!channel.ok()) return channel.status();
    const std::string& setup = (*setups)[std::size_t(*channel)];

    const Result<std::vector<std::string>> times = FoldersOf(setup, "timepoint", "/s0");
    if (!times.ok()) return times.status();
    if (times->empty()) return Refused(setup, "has no timepoint");
    const Result<std::int64_t> time = ChosenVolume(NameOf(setup), std::int64_t(times->size()), options_);
    if (!time.ok()) return time.status();
    const Result<Node> above = Read(setup), group = Read(Join(setup, (*times)[std::size_t(*time)]));
    if (!above.ok()) return above.status();
    if (!group.ok()) return group.status();
    Result<Pyramid> pyramid = Levels(*group, *above, xml->Of(setup, "setup"), {});  // each level is of one channel and one time
    if (!pyramid.ok()) return pyramid;
    pyramid->info.format = "BigDataViewer N5";
    pyramid->info.times.count = int(times->size());
    pyramid->info.time = int(*time);
    pyramid->info.channels = channels;
    pyramid->info.channel = *channel;
    return pyramid;
  }

  Result<Pyramid> Single(const Node& array) {
    Pyramid pyramid{.info = {.format = "N5"}};
    const Result<std::optional<Place>> place = PlaceOf(array.field());
    if (!place.ok()) return place.status();
    if (Status status = AddLevel(pyramid, array, array, options_); !status.ok()) return status;
    if (*place) PutAt(pyramid, **place);
    return pyramid;
  }

  // Folders that n5-viewer writes, a channel each: c0/s0, c1/s0, ...
  Result<Pyramid> Channels(const Node& group) {
    const Result<std::vector<std::string>> folders = FoldersOf(group.path, "c", "/s0");
    if (!folders.ok()) return folders.status();
    const std::vector<FieldInfo> channels(folders->size());
    const Result<int> channel = ChosenChannel(NameOf(group.path), channels, options_);
    if (!channel.ok()) return channel.status();
    const Result<Node> of_channel = Read(Join(group.path, (*folders)[std::size_t(*channel)]));
    if (!of_channel.ok()) return of_channel.status();
    ReadOptions options = options_;
    options.channel.reset();
    Result<Pyramid> pyramid = Levels(*of_channel, group, {}, options);
    if (!pyramid.ok()) return pyramid;
    if (channels.size() > 1) pyramid->info.channels = channels;
    pyramid->info.channel = *channel;
    return pyramid;
  }

  Result<bool> IsArray(const std::string& path) {
    const Result<Node> node = Read(path);
    if (!node.ok()) return node.status();
    return node->is_array();
  }

  // The only one of these folders that holds a volume. InvalidArgument, naming what there is: none, or several.
  Result<std::string> OnlyVolume(const std::vector<std::string>& folders) {
    constexpr std::size_t kMostLooked = 1000, kMostTold = 20;
    std::vector<std::string> found;
    for (std::size_t i = 0; i < std::min(folders.size(), kMostLooked); ++i) {
      const Result<Node> node = Read(folders[i]);
      const Result<bool> levels = node.ok() ? HasLevels(*node) : node.status();
      if ((node.ok() && node->is_array()) || (levels.ok() && *levels)) found.push_back(folders[i]);
    }
    if (found.size() == 1) return found[0];
    const std::vector<std::string>& told = found.empty() ? folders : found;
    std::string list;
    for (std::size_t i = 0; i < std::min(told.size(), kMostTold); ++i) list += (i > 0 ? ", " : "") + told[i];
    if (told.size() > kMostTold) list += ", ...";
    if (!found.empty()) return Refused("", fmt::format("holds {} volumes, of which ?array= takes one: {}", found.size(), list));
    return Refused("", list.empty() ? "holds no dataset" : "holds no dataset itself; ?array= takes the path of one below: " + list);
  }

  Result<Pyramid> At(const std::string& path) {
    const Result<std::optional<Pyramid>> found = Find(path);
    if (!found.ok()) return found.status();
    if (*found) return **found;
    return Refused(path, "is no dataset, and no group of levels: neither it nor s0 in it has dimensions");
  }

  // nullopt: nothing there is a volume.
  Result<std::optional<Pyramid>> Find(const std::string& path) {
    const auto found = [](Result<Pyramid> pyramid) -> Result<std::optional<Pyramid>> {
      return pyramid.ok() ? Result<std::optional<Pyramid>>(*std::move(pyramid)) : pyramid.status();
    };
    const Result<Node> node = Read(path);
    if (!node.ok()) return node.status();
    if (node->is_array()) return found(Single(*node));
    const Result<bool> levels = HasLevels(*node), channels = IsArray(Join(path, "c0/s0"));
    if (!levels.ok()) return levels.status();
    if (!*levels && channels.ok() && *channels) return found(Channels(*node));
    if (!*levels) return std::optional<Pyramid>();
    const std::size_t slash = path.find_last_of('/');
    const Result<Node> above = Read(slash == std::string::npos ? "" : path.substr(0, slash));
    if (!above.ok()) return above.status();
    return found(Levels(*node, *above, {}, options_));
  }

  const std::shared_ptr<Store> store_;
  const ReadOptions& options_;
  const SourceContext& context_;
  std::vector<std::string> files_;
};

}  // namespace

Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context) {
  return Container(store, options, context).Open();
}

}  // namespace n5

VolumeFormat N5() {
  return {.name = "N5",
          .recognises = n5::Recognises,
          .options = {"time", "channel", "array", "follow-links"},
          .markers = {n5::kAttributes},
          .open = OpenInStore<n5::OpenPyramid>};
}

}  // namespace slabstream
