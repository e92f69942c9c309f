#include "data/n5/n5_place.h"

#include <fmt/format.h>

#include <algorithm>

#include "data/volume_io/length_names.h"
#include "data/volume_io/stated_field.h"

namespace slabstream::n5 {
namespace {

using metadata::Field;

std::vector<std::string> TextsOf(const Field& list) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) texts.push_back(list[i].is_text() ? list[i].Text().value() : "");
  return texts;
}

int AxisOf(const std::string& name) { return name == "x" ? 0 : name == "y" ? 1 : name == "z" ? 2 : -1; }

// Names as the attribute `axes` lists them, slowest first. N5 counts from x on; those who think of arrays in C begin with z.
std::vector<std::string> SlowestFirst(std::vector<std::string> names) {
  if (!names.empty() && (names.front() == "x" || names.back() != "x")) std::ranges::reverse(names);
  return names;
}

// x, y and z of a list that `axes` explains, if it has names; else x comes first.
std::optional<Vec3> Triple(const Field& list, const std::vector<std::string>& axes, bool positive = true) {
  if (!list.is_array() || list.size() < 3) return std::nullopt;
  Vec3 triple;
  const bool named = axes.size() == list.size();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const int axis = named ? AxisOf(axes[i]) : i < 3 ? int(i) : -1;
    const Result<double> number = list[i].Number();
    if (axis < 0) continue;
    if (!number.ok() || (positive && !(*number > 0))) return std::nullopt;
    triple[axis] = *number;
  }
  return triple;
}

std::optional<LengthUnit> UnitOf(const Field& text) { return text.is_text() ? LengthUnitNamed(text.Text().value()) : std::nullopt; }

// COSEM's lists are in the order of `axes`, else z, y, x.
Result<std::optional<Place>> OfTransform(const Field& transform) {
  std::vector<std::string> axes = TextsOf(transform["axes"]);
  const Field scale = transform["scale"], translate = transform["translate"], units = transform["units"];
  if (axes.empty()) axes = {"z", "y", "x"};
  if (scale.size() != axes.size()) return scale.Wrong(fmt::format("a list of {} numbers", axes.size()));
  Place place{.origin = Vec3{}, .of_level = true, .attribute = "transform"};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const int axis = AxisOf(axes[i]);
    if (axis < 0) continue;
    const Result<double> step = scale[i].Number();
    if (!step.ok()) return step.status();
    if (!(*step > 0)) return scale[i].Wrong("above 0");
    place.spacing[axis] = *step;
    if (translate.given()) {
      const Result<double> first = translate[i].Number();
      if (!first.ok()) return first.status();
      (*place.origin)[axis] = *first;
    }
    const std::optional<LengthUnit> unit = UnitOf(units[i]);
    if (place.unit && unit && *unit != *place.unit) return units.Wrong("one unit for all axes of space");
    if (unit) place.unit = unit;
  }
  return std::optional(place);
}

// The place of a pixel 0 is -xOrigin, in pixels.
std::optional<Place> OfImageJ(const Field& attributes) {
  Place place{.attribute = "pixelWidth"};
  Vec3 origin;
  constexpr const char* kSizes[] = {"pixelWidth", "pixelHeight", "pixelDepth"};
  constexpr const char* kOrigins[] = {"xOrigin", "yOrigin", "zOrigin"};
  for (int axis = 0; axis < 3; ++axis) {
    const Result<double> size = attributes[kSizes[axis]].Number();
    if (!size.ok() || !(*size > 0)) return std::nullopt;
    place.spacing[axis] = *size;
    if (const Result<double> pixels = attributes[kOrigins[axis]].Number(); pixels.ok()) origin[axis] = -*pixels * *size;
  }
  place.unit = UnitOf(attributes["pixelUnit"]);
  if (origin != Vec3{}) place.origin = origin;
  return place;
}

}  // namespace

Result<std::vector<std::string>> AxisNames(const Field& own, const Field& group, const std::vector<std::uint64_t>& size) {
  for (const Field* const attributes : {&own, &group}) {
    const std::vector<std::string> of_transform = TextsOf((*attributes)["transform"]["axes"]), axes = TextsOf((*attributes)["axes"]);
    if (of_transform.size() == size.size()) return of_transform;
    if (axes.size() == size.size()) return SlowestFirst(axes);
  }
  for (const Field* const attributes : {&own, &group}) {
    const Field channels = (*attributes)["numChannels"], times = (*attributes)["numFrames"], slices = (*attributes)["numSlices"];
    if (!channels.given() && !times.given()) continue;
    // x, y, c, z and t, without those of 1 or with them. How many slices a level has does not matter.
    const auto count = [](const Field& field) {
      const Result<std::uint64_t> whole = field.Whole(1, metadata::kMostElements);
      return whole.ok() ? *whole : 1;
    };
    for (const bool all : {false, true}) {
      std::vector<std::string> names = {"x", "y"};
      bool fits = true;
      const auto add = [&](const char* name, std::uint64_t wanted) {
        if (!all && wanted == 1) return;
        fits = fits && names.size() < size.size() && (*name == 'z' || size[size.size() - 1 - names.size()] == wanted);
        names.emplace_back(name);
      };
      add("c", count(channels));
      add("z", count(slices));
      add("t", count(times));
      std::ranges::reverse(names);
      if (fits && names.size() == size.size()) return names;
    }
    return (channels.given() ? channels : times)
        .Wrong(fmt::format("that of a dataset of {}, whose axes are x, y, channels, slices and frames",
                           fmt::join(size.rbegin(), size.rend(), " x ")));
  }
  return std::vector<std::string>(size.size());
}

TimeAxis TimesOf(const Field& own, const Field& group, int count) {
  for (const Field* const attributes : {&own, &group}) {
    const Field transform = (*attributes)["transform"], units = transform["units"];
    const std::vector<std::string> axes = TextsOf(transform["axes"]);
    const auto axis = std::size_t(std::ranges::find(axes, "t") - axes.begin());
    const Result<double> of_transform = transform["scale"][axis].Number(), interval = (*attributes)["frameInterval"].Number();
    if (axis < axes.size() && of_transform.ok()) return StatedTimes(count, *of_transform, units[axis].is_text() ? *units[axis].Text() : "");
    if (interval.ok()) return StatedTimes(count, *interval, "");
  }
  return {.count = count};
}

Result<std::optional<Place>> PlaceOf(const Field& attributes) {
  if (attributes["transform"].is_object()) return OfTransform(attributes["transform"]);
  const std::vector<std::string> axes = TextsOf(attributes["axes"]);
  const Field pixel = attributes["pixelResolution"], units = attributes["units"];
  std::optional<Place> place;
  if (const auto spacing = Triple(pixel.is_array() ? pixel : pixel["dimensions"], axes)) {
    place = {.spacing = *spacing, .unit = UnitOf(pixel["unit"]), .attribute = "pixelResolution"};
  } else if (const auto resolution = Triple(attributes["resolution"], axes)) {
    place = {.spacing = *resolution, .attribute = "resolution"};
  } else {
    place = OfImageJ(attributes);
  }
  if (!place) return place;
  for (const Field& unit : {units, attributes["unit"], units[std::size_t{0}]}) {
    if (!place->unit) place->unit = UnitOf(unit);
  }
  if (const auto offset = Triple(attributes["offset"], axes, false)) place->origin = offset;
  return place;
}

}  // namespace slabstream::n5
