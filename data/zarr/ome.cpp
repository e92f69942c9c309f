#include "data/zarr/ome.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "data/sources/chunked_array.h"
#include "data/volume_io/length_names.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

constexpr std::size_t kMostLevels = 64, kMostDescribed = 4096, kMostTransformations = 8;

// From Zarr 3 on, what OME says has a member of its own.
Field OmeField(const Field& attributes, int zarr_version) { return zarr_version == 3 ? attributes["ome"] : attributes; }

Result<OmeAxis> ReadAxis(const Field& field) {
  const Field name_field = field.is_text() ? field : field["name"];  // before 0.4 an axis is its name
  const Result<std::string> name = name_field.Text();
  if (!name.ok()) return name.status();
  OmeAxis axis{.name = *name, .kind = AxisNamed(*name)};
  if (const Field type = field["type"]; type.is_text()) {
    if (type.value() == "time") axis.kind = AxisKind::kTime;
    if (type.value() == "channel") axis.kind = AxisKind::kChannel;
    if (type.value() == "space" && !IsSpace(axis.kind)) {
      return name_field.Wrong("x, y or z, as the axes of type space are called");
    }
  }
  if (const Field unit = field["unit"]; unit.is_text() && IsSpace(axis.kind)) {
    axis.unit = LengthUnitNamed(unit.value().get_ref<const std::string&>());
  }
  return axis;
}

Result<std::vector<OmeAxis>> ReadAxes(const Field& field) {
  std::vector<OmeAxis> axes;
  if (!field.stated()) {  // 0.1 and 0.2
    for (const char* const name : {"t", "c", "z", "y", "x"}) axes.push_back({name, AxisNamed(name)});
    return axes;
  }
  if (!field.is_array() || field.size() < 2 || field.size() > kMaxArrayAxes) {
    return field.Wrong(fmt::format("a list of 2 to {} axes", kMaxArrayAxes));
  }
  for (std::size_t i = 0; i < field.size(); ++i) {
    Result<OmeAxis> axis = ReadAxis(field[i]);
    if (!axis.ok()) return axis.status();
    const bool twice = axis->kind != AxisKind::kOther && std::ranges::find(axes, axis->kind, &OmeAxis::kind) != axes.end();
    if (twice) return field[i].Wrong("another axis than those before it");
    axes.push_back(*std::move(axis));
  }
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY}) {
    if (std::ranges::find(axes, kind, &OmeAxis::kind) == axes.end()) return field.Wrong("axes of which one is x and one is y");
  }
  return axes;
}

struct Stated {
  bool scale = false, translation = false;
};

// Applies a list of transformations to what `level` has so far. What they are.
Result<Stated> Transform(const Field& list, const std::vector<OmeAxis>& axes, OmeLevel& level) {
  if (!list.stated()) return Stated{};
  if (!list.is_array() || list.size() > kMostTransformations) {
    return list.Wrong(fmt::format("a list of at most {} transformations", kMostTransformations));
  }
  Stated stated;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Field one = list[i], type = one["type"];
    if (type.is_text() && type.value() == "identity") continue;
    const bool scale = type.is_text() && type.value() == "scale";
    if (!scale && !(type.is_text() && type.value() == "translation")) return type.Wrong("scale or translation");
    const Field numbers = one[scale ? "scale" : "translation"];
    if (!numbers.is_array() || numbers.size() != axes.size()) return numbers.Wrong(fmt::format("a list of {} numbers", axes.size()));
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const Result<double> number = numbers[axis].Number();
      if (!number.ok()) return number.status();
      if (scale) {
        level.scale[axis] *= *number;
        level.translation[axis] *= *number;
      } else {
        level.translation[axis] += *number;
      }
      if (!IsSpace(axes[axis].kind)) continue;
      if (scale && !(*number > 0)) return numbers[axis].Wrong("above 0");
      if (!(level.scale[axis] > 0) || !std::isfinite(level.scale[axis]) || !std::isfinite(level.translation[axis])) {
        return numbers[axis].Wrong("such that all scales and translations are finite");
      }
    }
    (scale ? stated.scale : stated.translation) = true;
  }
  return stated;
}

OmeChannel ReadChannel(const Field& field) {
  OmeChannel channel;
  if (const Field label = field["label"]; label.is_text()) channel.name = *label.Text();
  const Result<double> start = field["window"]["start"].Number(), end = field["window"]["end"].Number();
  if (start.ok() && end.ok() && *start < *end) channel.window = ValueRange{float(*start), float(*end)};
  return channel;
}

}  // namespace

bool IsOmeImage(const Field& attributes, int zarr_version) { return OmeField(attributes, zarr_version)["multiscales"].stated(); }

Result<OmeImage> ParseOmeImage(const Field& attributes, int zarr_version) {
  const Field ome = OmeField(attributes, zarr_version), images = ome["multiscales"], image = images[0], datasets = image["datasets"];
  if (!images.is_array() || images.size() < 1) return images.Wrong("a list of images");
  OmeImage read;
  const Field version = zarr_version == 3 ? ome["version"] : image["version"];
  read.version = version.is_text() ? *version.Text() : zarr_version == 3 ? "0.5" : "0.4";
  static constexpr std::array<std::string_view, 5> kVersions = {"0.1", "0.2", "0.3", "0.4", "0.5"};
  if (std::ranges::find(kVersions, read.version) == kVersions.end()) return version.Wrong("a version of OME-Zarr from 0.1 to 0.5");
  Result<std::vector<OmeAxis>> axes = ReadAxes(image["axes"]);
  if (!axes.ok()) return axes.status();
  read.axes = *std::move(axes);

  if (!datasets.is_array() || datasets.size() < 1 || datasets.size() > kMostLevels) {
    return datasets.Wrong(fmt::format("a list of 1 to {} levels", kMostLevels));
  }
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    const Result<std::string> path = datasets[i]["path"].Text();
    if (!path.ok()) return path.status();
    OmeLevel level{*path, std::vector<double>(read.axes.size(), 1.0), std::vector<double>(read.axes.size(), 0.0)};
    const Result<Stated> stated = Transform(datasets[i]["coordinateTransformations"], read.axes, level);
    if (!stated.ok()) return stated.status();
    read.scaled = read.scaled || stated->scale;
    read.translated = read.translated || stated->translation;
    const Result<Stated> all = Transform(image["coordinateTransformations"], read.axes, level);  // moves all levels alike
    if (!all.ok()) return all.status();
    read.levels.push_back(std::move(level));
  }

  const Field channels = ome["omero"]["channels"];
  for (std::size_t i = 0; channels.is_array() && i < std::min(channels.size(), kMostDescribed); ++i) {
    read.channels.push_back(ReadChannel(channels[i]));
  }
  read.labels = ome["image-label"].stated();
  return read;
}

}  // namespace slabstream::zarr
