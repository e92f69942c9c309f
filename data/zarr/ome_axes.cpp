#include "data/zarr/ome_axes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "data/sources/chunked_array.h"
#include "data/volume_io/length_names.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

constexpr std::size_t kMostTransformations = 8, kMostNested = 4;

Result<OmeAxis> ReadAxis(const Field& field, bool& space) {
  const Field name_field = field.is_text() ? field : field["name"];  // before 0.4 an axis is its name
  const Result<std::string> name = name_field.Text();
  if (!name.ok()) return name.status();
  OmeAxis axis{.name = *name, .kind = AxisNamed(*name)};
  const Field type = field["type"], unit = field["unit"];
  space = type.is_text() ? type.value() == "space" : IsSpace(axis.kind);
  if (type.is_text() && type.value() == "time") axis.kind = AxisKind::kTime;
  if (type.is_text() && type.value() == "channel") axis.kind = AxisKind::kChannel;
  if (space && !IsSpace(axis.kind)) axis.kind = AxisKind::kOther;
  if (space && unit.is_text()) axis.unit = LengthUnitNamed(*unit.Text());
  if (axis.kind == AxisKind::kTime && unit.is_text()) axis.time_unit = *unit.Text();
  return axis;
}

// The scale and the translation along each axis that one transformation stands for.
Result<OmePlace> ReadOne(const Field& one, std::size_t axes) {
  OmePlace place{std::vector<double>(axes, 1.0), std::vector<double>(axes, 0.0)};
  const Result<std::string> type = one["type"].Text();
  if (!type.ok()) return type.status();
  const Field value = one[*type];
  const auto sized = [&](const Field& list, std::size_t size) {
    return list.is_array() && list.size() == size ? Status::Ok() : list.Wrong(fmt::format("a list of {} numbers", size));
  };
  if (*type == "identity") return place;
  if (*type == "scale" || *type == "translation") {
    std::vector<double>& numbers = *type == "scale" ? place.scale : place.translation;
    if (Status status = sized(value, axes); !status.ok()) return status;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const Result<double> number = value[axis].Number();
      if (!number.ok()) return number.status();
      numbers[axis] = *number;
    }
    (*type == "scale" ? place.scaled : place.translated) = true;
    return place;
  }
  if (*type == "mapAxis") {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      if (const Result<std::uint64_t> from = value[axis].Whole(axis, axis); !from.ok()) return from.status();
    }
    return place;
  }
  if (*type != "affine" && *type != "rotation") {
    return one["type"].Wrong("one of scale, translation, identity, sequence, affine, rotation and mapAxis");
  }
  // Rows of a matrix; an affine one has a column more, of the translation.
  place.scaled = place.translated = *type == "affine";
  for (std::size_t row = 0; row < axes; ++row) {
    if (Status status = sized(value[row], axes + (place.scaled ? 1 : 0)); !status.ok()) return status;
    for (std::size_t column = 0; column < value[row].size(); ++column) {
      const Result<double> number = value[row][column].Number();
      if (!number.ok()) return number.status();
      if (column == axes) {
        place.translation[row] = *number;
      } else if (column == row) {
        place.scale[row] = *number;
      } else if (*number != 0) {
        return value[row][column].Wrong("0: transformations that turn or shear axes are not supported");
      }
    }
  }
  return place;
}

Status Apply(const Field& list, const std::vector<OmeAxis>& axes, std::size_t nested, OmePlace& place) {
  if (!list.stated()) return Status::Ok();
  if (!list.is_array() || list.size() > kMostTransformations || nested > kMostNested) {
    return list.Wrong(fmt::format("a list of at most {} transformations, in at most {} sequences", kMostTransformations, kMostNested));
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Field one = list[i];
    if (one["type"].is_text() && one["type"].value() == "sequence") {
      if (Status status = Apply(one["transformations"], axes, nested + 1, place); !status.ok()) return status;
      continue;
    }
    const Result<OmePlace> step = ReadOne(one, axes.size());
    if (!step.ok()) return step.status();
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      place.scale[axis] *= step->scale[axis];
      place.translation[axis] = place.translation[axis] * step->scale[axis] + step->translation[axis];
      if (!IsSpace(axes[axis].kind)) continue;
      if (!(place.scale[axis] > 0) || !std::isfinite(place.scale[axis]) || !std::isfinite(place.translation[axis])) {
        return one[*one["type"].Text()][axis].Wrong("such that scales are above 0, and scales and translations finite");
      }
    }
    place.scaled = place.scaled || step->scaled;
    place.translated = place.translated || step->translated;
  }
  return Status::Ok();
}

}  // namespace

Result<std::vector<OmeAxis>> ReadOmeAxes(const Field& list) {
  std::vector<OmeAxis> axes;
  if (!list.stated()) {
    for (const char* const name : {"t", "c", "z", "y", "x"}) axes.push_back({name, AxisNamed(name)});
    return axes;
  }
  if (!list.is_array() || list.size() < 2 || list.size() > kMaxArrayAxes) {
    return list.Wrong(fmt::format("a list of 2 to {} axes", kMaxArrayAxes));
  }
  std::vector<std::size_t> unnamed;
  const auto has = [&](AxisKind kind) { return std::ranges::find(axes, kind, &OmeAxis::kind) != axes.end(); };
  for (std::size_t i = 0; i < list.size(); ++i) {
    bool space = false;
    Result<OmeAxis> axis = ReadAxis(list[i], space);
    if (!axis.ok()) return axis.status();
    if (axis->kind != AxisKind::kOther && has(axis->kind)) return list[i].Wrong("another axis than those before it");
    if (space && axis->kind == AxisKind::kOther) unnamed.push_back(i);
    axes.push_back(*std::move(axis));
  }
  for (const AxisKind kind : {AxisKind::kX, AxisKind::kY, AxisKind::kZ}) {
    if (has(kind) || unnamed.empty()) continue;
    axes[unnamed.back()].kind = kind;
    unnamed.pop_back();
  }
  if (!unnamed.empty()) return list[unnamed.back()].Wrong("another axis: an image has at most 3 of type space");
  if (!has(AxisKind::kX) || !has(AxisKind::kY)) return list.Wrong("axes of which one is x and one is y");
  return axes;
}

Status ApplyTransformations(const Field& list, const std::vector<OmeAxis>& axes, OmePlace& place) { return Apply(list, axes, 0, place); }

}  // namespace slabstream::zarr
