#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <optional>

#include "client/request/slice_planes.h"
#include "client/request/values.h"
#include "common/cli/parse.h"
#include "common/text/split.h"
#include "common/view/world_limits.h"

namespace slabstream {
namespace {

// Takes a value; `of`: what it is of, for messages.
struct Taker {
  std::string_view name;
  std::function<Status(const std::string& of, const std::string& value)> take;
};

template <class T, class Parsed>
Status Take(T& target, Parsed parsed) {
  if (parsed.ok()) target = *std::move(parsed);
  return parsed.status();
}

Taker TakerOf(double& opacity) {
  return {"opacity", [&opacity](const std::string& of, const std::string& value) {
            Status status = Take(opacity, ParseNumber(of, value, {0, 1}));
            return status.ok() && opacity == 0 ? Status::InvalidArgument(of + " is 0, but must lie in (0, 1]") : status;
          }};
}
Taker TakerOf(std::string& map) {
  return {"map", [&map](const std::string&, const std::string& value) {
            map = value;
            return Status::Ok();
          }};
}
Taker TakerOf(std::optional<ScalarRange>& range) {
  return {"range", [&range](const std::string& of, const std::string& value) { return Take(range, ParseScalarRange(of, value)); }};
}

// `rest` of `text`: nothing, or ",NAME=VALUE,...".
Status TakeEach(std::string_view option, std::string_view text, std::string_view rest, std::initializer_list<Taker> takers) {
  if (rest.empty()) return Status::Ok();
  const Result<std::vector<NamedText>> named = ParseNamedTexts(option, rest.substr(1));
  if (!named.ok()) return named.status();
  for (const auto& [name, value] : *named) {
    const auto* const taker = std::ranges::find(takers, name, &Taker::name);
    if (taker == takers.end()) {
      std::vector<std::string_view> names;
      for (const Taker& each : takers) names.push_back(each.name);
      return Status::InvalidArgument(fmt::format("{} '{}' has '{}', but must have one of: {}", option, text, name, fmt::join(names, ", ")));
    }
    if (Status status = taker->take(fmt::format("{} {}", option, name), value); !status.ok()) return status;
  }
  return Status::Ok();
}

// "X/Y/Z"; none: it is no such text.
std::optional<Vec3> ThreeOf(std::string_view option, std::string_view text) {
  const std::vector<std::string_view> parts = Split(text, '/');
  if (parts.size() != 3) return std::nullopt;
  Vec3 three;
  for (int i = 0; i < 3; ++i) {
    const Result<double> number = ParseNumber(option, parts[std::size_t(i)], {-kMaxCoordinate, kMaxCoordinate});
    if (!number.ok()) return std::nullopt;
    three[i] = *number;
  }
  return three;
}
std::string TextOfThree(const Vec3& three) { return fmt::format("{}/{}/{}", three.x, three.y, three.z); }

// The axis that the normal lies along.
std::optional<Axis> AxisOf(const Vec3& normal) {
  for (const Axis axis : kAxes) {
    if (std::abs(normal[axis]) == Length(normal)) return axis;
  }
  return std::nullopt;
}

Status ParseWhere(const std::string& option, std::string_view where, ClipSlab& slab) {
  const std::size_t equals = std::min(where.find('='), where.size());
  const std::string_view name = where.substr(0, equals), value = equals < where.size() ? where.substr(equals + 1) : "";
  const std::optional<Axis> axis = AxisOf(slab.normal);
  if (name == "index") return Take(slab.index, ParseInteger(option + " index", value, 0, kMaxVolumeSide - 1));
  if (name == "at") {
    slab.through = ThreeOf(option, value);
    return slab.through ? Status::Ok() : Status::InvalidArgument(fmt::format("{} at '{}' is not X/Y/Z", option, value));
  }
  if (axis && name == std::string(1, Letter(*axis))) {
    return Take(slab.through.emplace()[*axis], ParseNumber(fmt::format("{} {}", option, name), value, {-kMaxCoordinate, kMaxCoordinate}));
  }
  return Status::InvalidArgument(fmt::format("{} has '{}', but must have one of: {}index=N, at=X/Y/Z", option, where,
                                             axis ? fmt::format("{}=N, ", Letter(*axis)) : ""));
}

}  // namespace

Result<ShapeChoice> ParseShape(std::string_view option, std::string_view text) {
  constexpr std::string_view kPixels = "px";
  std::string_view rest = text;
  ShapeChoice shape{.shape = TakeName(rest, ",")};
  if (Status status = CheckName(option, text, shape.shape); !status.ok()) return status;
  const Taker color = {"color",
                       [&](const std::string& of, const std::string& value) { return Take(shape.color, ParseOpaqueColor(of, value)); }};
  const Taker width = {"width", [&](const std::string& of, const std::string& value) {
                         shape.width_in_pixels = value.ends_with(kPixels);
                         const std::size_t digits = value.size() - (shape.width_in_pixels ? kPixels.size() : 0);
                         return Take(shape.width, ParseNumber(of, value.substr(0, digits), {0, kMaxCoordinate}));
                       }};
  const Taker time = {
      "time", [&](const std::string& of, const std::string& value) { return Take(shape.time, ParseInteger(of, value, 0, kMaxShapeTime)); }};
  const Status taken = TakeEach(option, text, rest, {color, TakerOf(shape.opacity), width, TakerOf(shape.map), TakerOf(shape.range), time});
  return taken.ok() ? Result<ShapeChoice>(std::move(shape)) : taken;
}

Result<PlaneChoice> ParsePlane(std::string_view option, std::string_view text) {
  PlaneChoice plane;
  const std::size_t end = std::min(text.find(','), text.size()), colon = std::min(text.find(':'), end);
  const std::string_view name = text.substr(0, colon);
  const auto* const known = std::ranges::find(kSlicePlanes, name, &SlicePlane::name);
  const std::optional<Vec3> normal = known != kSlicePlanes.end() ? known->normal : ThreeOf(option, name);
  if (!normal || *normal == Vec3{}) {
    std::vector<std::string_view> names;
    for (const SlicePlane& each : kSlicePlanes) names.push_back(each.name);
    return Status::InvalidArgument(
        fmt::format("{} '{}' has plane '{}', but must have one of: {}, or a normal X/Y/Z", option, text, name, fmt::join(names, ", ")));
  }
  plane.slab.normal = *normal;
  if (colon < end) {
    const Status where = ParseWhere(fmt::format("{} '{}'", option, text), text.substr(colon + 1, end - colon - 1), plane.slab);
    if (!where.ok()) return where;
  }
  const Status taken = TakeEach(option, text, text.substr(end), {TakerOf(plane.opacity), TakerOf(plane.map), TakerOf(plane.range)});
  return taken.ok() ? Result<PlaneChoice>(std::move(plane)) : taken;
}

std::string TextOf(const ShapeChoice& shape) {
  std::string text = TextOfName(shape.shape);
  if (shape.color) text += ",color=" + TextOf(*shape.color);
  if (shape.opacity != 1) text += fmt::format(",opacity={}", shape.opacity);
  if (shape.width != 0) text += fmt::format(",width={}{}", shape.width, shape.width_in_pixels ? "px" : "");
  if (!shape.map.empty()) text += ",map=" + shape.map;
  if (shape.range) text += ",range=" + TextOf(*shape.range);
  if (shape.time) text += fmt::format(",time={}", *shape.time);
  return text;
}

std::string TextOf(const PlaneChoice& plane) {
  const auto& [normal, through, index, thickness] = plane.slab;
  std::string text = TextOfThree(normal);
  for (const SlicePlane& each : kSlicePlanes) {
    if (each.normal == normal) text = each.name;  // the last one: those of patients have the same normals
  }
  if (index) text += fmt::format(":index={}", *index);
  if (through) {
    const std::optional<Axis> axis = AxisOf(normal);
    Vec3 along;
    if (axis) along[*axis] = (*through)[*axis];
    text += axis && along == *through ? fmt::format(":{}={}", Letter(*axis), along[*axis]) : ":at=" + TextOfThree(*through);
  }
  if (plane.opacity != 1) text += fmt::format(",opacity={}", plane.opacity);
  if (!plane.map.empty()) text += ",map=" + plane.map;
  if (plane.range) text += ",range=" + TextOf(*plane.range);
  return text;
}

}  // namespace slabstream
