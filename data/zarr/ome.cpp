#include "data/zarr/ome.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "common/base/printable.h"
#include "data/volume_io/stated_field.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

constexpr std::size_t kMostLevels = 64, kMostDescribed = 4096, kMostLooks = 65536;

FieldInfo ReadChannel(const Field& field) {
  FieldInfo channel;
  if (const Field label = field["label"]; label.is_text()) channel.name = *label.Text();
  if (const Field color = field["color"]; color.is_text()) channel.color = ColorOfHex(*color.Text());
  const Result<double> start = field["window"]["start"].Number(), end = field["window"]["end"].Number();
  if (start.ok() && end.ok()) channel.window = StatedWindow(*start, *end);
  const Field active = field["active"];
  channel.shown = !active.given() || active.value() != false;
  return channel;
}

// "0.4", "0.5.2", "0.4-dev-spatialdata"
bool IsKnownVersion(std::string_view version) {
  const bool known = version.size() >= 3 && version.starts_with("0.") && version[2] >= '1' && version[2] <= '6';
  return known && (version.size() == 3 || version[3] < '0' || version[3] > '9');
}

Result<std::string> ReadVersion(const Field& version, std::string_view usual) {
  if (!version.given()) return std::string(usual);
  const std::string text = version.is_text() ? *version.Text() : version.value().dump();
  return IsKnownVersion(text) ? Result<std::string>(text) : version.Wrong("a version of OME-Zarr from 0.1 to 0.6");
}

// Up to 0.5 an image has axes; then it has coordinate systems, into one of which the transformations of its levels lead.
Field AxesOf(const Field& image) {
  const Field systems = image["coordinateSystems"];
  if (!systems.is_array()) return image["axes"];
  const Field output = image["datasets"][0]["coordinateTransformations"][0]["output"], name = output.is_text() ? output : output["name"];
  for (std::size_t i = 0; i < std::min(systems.size(), kMostLevels); ++i) {
    if (name.is_text() && systems[i]["name"].is_text() && systems[i]["name"].value() == name.value()) return systems[i]["axes"];
  }
  return systems[0]["axes"];
}

bool AreIdentities(const Field& transformations) {
  bool all = true;
  for (std::size_t i = 0; i < transformations.size(); ++i) {
    const Field type = transformations[i]["type"];
    all = all && type.is_text() && type.value() == "identity";
  }
  return all;
}

// What axes say that is not taken.
std::vector<std::string> NotesOfAxes(const Field& fields, const std::vector<OmeAxis>& axes) {
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Field unit = fields[i]["unit"];
    if (fields[i]["orientation"].given())
      notes.push_back(Printable(fmt::format("the orientation of axis {} is not applied", axes[i].name)));
    if (!IsSpace(axes[i].kind) || axes[i].unit || !unit.is_text()) continue;
    notes.push_back(Printable(fmt::format("the unit '{}' of axis {} is not known, so lengths have none", *unit.Text(), axes[i].name)));
  }
  return notes;
}

// Colours and names of labels, by their values.
std::vector<StatedLabel> ReadLooks(const Field& label_image) {
  std::map<std::uint64_t, StatedLabel> looks;
  const auto look_of = [&](const Field& entry) -> StatedLabel* {
    const Result<std::uint64_t> value = entry["label-value"].Whole(1, std::numeric_limits<std::uint64_t>::max());
    if (!value.ok() || (looks.size() >= kMostLooks && !looks.contains(*value))) return nullptr;
    return &looks.try_emplace(*value, StatedLabel{.value = *value}).first->second;
  };
  const Field colors = label_image["colors"], properties = label_image["properties"];
  for (std::size_t i = 0; colors.is_array() && i < colors.size(); ++i) {
    std::array<float, 3> color{};
    bool right = true;
    for (std::size_t component = 0; component < 3; ++component) {
      const Result<double> code = colors[i]["rgba"][component].Number();
      right = right && code.ok();
      if (right) color.at(component) = float(std::clamp(*code / 255, 0.0, 1.0));
    }
    if (StatedLabel* const look = right ? look_of(colors[i]) : nullptr) look->color = color;
  }
  for (std::size_t i = 0; properties.is_array() && i < properties.size(); ++i) {
    for (const char* const key : {"name", "label", "class"}) {
      const Field name = properties[i][key];
      StatedLabel* const look = name.is_text() ? look_of(properties[i]) : nullptr;
      if (look != nullptr && look->name.empty()) look->name = *name.Text();
    }
  }
  std::vector<StatedLabel> ascending;
  for (auto& [value, look] : looks) ascending.push_back(std::move(look));
  return ascending;
}

}  // namespace

Field OmeField(const Field& attributes) {
  const Field ome = attributes["ome"];
  return ome.is_object() && (ome["multiscales"].stated() || !attributes["multiscales"].stated()) ? ome : attributes;
}

bool IsOmeImage(const Field& attributes) { return OmeField(attributes)["multiscales"].stated(); }

Result<OmeImage> ParseOmeImage(const Field& attributes) {
  const Field ome = OmeField(attributes), images = ome["multiscales"], image = images[0], datasets = image["datasets"];
  if (!images.is_array() || images.size() < 1) return images.Wrong("a list of images");
  OmeImage read;
  const Result<std::string> version =
      ReadVersion(ome["version"].given() ? ome["version"] : image["version"], attributes["ome"].is_object() ? "0.5" : "0.4");
  if (!version.ok()) return version.status();
  read.version = *version;
  const Field axes_field = AxesOf(image), of_all = image["coordinateTransformations"];
  Result<std::vector<OmeAxis>> axes = ReadOmeAxes(axes_field);
  if (!axes.ok()) return axes.status();
  read.axes = *std::move(axes);
  read.notes = NotesOfAxes(axes_field, read.axes);
  // From 0.6 on, and as spatialdata writes them, these lead to further coordinate systems; else they move all levels alike.
  const bool further = image["coordinateSystems"].is_array() || of_all[0]["output"].given();
  if (further && !AreIdentities(of_all)) {
    read.notes.emplace_back("places are those of the image's own coordinate system; its transformations to others are not applied");
  }
  if (images.size() > 1) read.notes.push_back(fmt::format("of {} multiscales the first one is shown", images.size()));

  if (!datasets.is_array() || datasets.size() < 1 || datasets.size() > kMostLevels) {
    return datasets.Wrong(fmt::format("a list of 1 to {} levels", kMostLevels));
  }
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    const Result<std::string> path = datasets[i]["path"].Text();
    if (!path.ok()) return path.status();
    OmeLevel level{*path, {std::vector<double>(read.axes.size(), 1.0), std::vector<double>(read.axes.size(), 0.0)}};
    Status status = ApplyTransformations(datasets[i]["coordinateTransformations"], read.axes, level.place);
    read.scaled = read.scaled || level.place.scaled;
    read.translated = read.translated || level.place.translated;
    if (status.ok() && !further) status = ApplyTransformations(of_all, read.axes, level.place);
    if (!status.ok()) return status;
    read.levels.push_back(std::move(level));
  }

  const Field channels = ome["omero"]["channels"], label_image = ome["image-label"];
  for (std::size_t i = 0; channels.is_array() && i < std::min(channels.size(), kMostDescribed); ++i) {
    read.channels.push_back(ReadChannel(channels[i]));
  }
  read.labels = label_image.stated();
  read.looks = ReadLooks(label_image);
  return read;
}

}  // namespace slabstream::zarr
