#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/printable.h"
#include "data/hdf5/hdf5_image.h"
#include "data/metadata/json_fields.h"
#include "data/sources/axis_kind.h"
#include "data/volume_io/even_steps.h"
#include "data/volume_io/length_names.h"

namespace slabstream {
namespace {

std::string LastPart(const std::string& path) { return path.substr(path.rfind('/') + 1); }

// The axis that a coordinate variable of CF is for: by its attributes, else by its name.
std::string NameOfScale(AttributedFile& file, const std::string& scale) {
  static constexpr std::pair<std::string_view, std::string_view> kStandardNames[] = {
      {"longitude", "x"}, {"projection_x_coordinate", "x"}, {"grid_longitude", "x"},
      {"latitude", "y"},  {"projection_y_coordinate", "y"}, {"grid_latitude", "y"},
      {"time", "t"}};
  if (scale.empty()) return "";
  if (const std::string axis = file.Text(scale, "axis").value_or(""); axis.size() == 1 && AxisNamed(axis) != AxisKind::kOther) return axis;
  const std::string standard = file.Text(scale, "standard_name").value_or(""), units = file.Text(scale, "units").value_or("");
  const auto* const known = std::ranges::find(kStandardNames, standard, [](const auto& each) { return each.first; });
  if (known != std::end(kStandardNames)) return std::string(known->second);
  if (units.starts_with("degrees_e") || units.starts_with("degree_e")) return "x";
  if (units.starts_with("degrees_n") || units.starts_with("degree_n")) return "y";
  if (units.find(" since ") != std::string::npos) return "t";
  return file.Text(scale, "positive") ? "z" : LastPart(scale);
}

// vigra and ilastik: a list of axes in JSON, in the order of the dataset. A resolution of 0 is none.
Result<bool> TakeAxistags(AttributedFile& file, const std::string& path, ImageDescription& image) {
  const std::optional<std::string> text = file.Text(path, "axistags");
  if (!text) return false;
  const std::string named = file.Named(path) + ": axistags";
  const Result<Json> json = metadata::ParseJson(named, *text);
  if (!json.ok()) return json.status();
  const metadata::Field axes = metadata::Field(named, *json)["axes"];
  if (axes.size() != image.axes.size()) return axes.Wrong(fmt::format("a list of {} axes, as the dataset has", image.axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Result<std::string> key = axes[i]["key"].Text();
    if (!key.ok()) return key.status();
    image.axes[i].name = *key;
    if (const Result<double> resolution = axes[i]["resolution"].Number(); resolution.ok() && *resolution > 0)
      image.axes[i].step = *resolution;
  }
  image.axes_from = "axistags";
  return true;
}

// Numbers of an attribute, one for each axis, or for each one that is neither time nor channel, or for the last three of these.
bool TakeNumbers(AttributedFile& file, const std::string& path, const char* attribute, ImageDescription& image, double ImageAxis::*member) {
  std::vector<double> numbers = file.Numbers(path, attribute).value_or(std::vector<double>{});
  std::vector<ImageAxis*> axes;
  for (ImageAxis& axis : image.axes) {
    const AxisKind kind = AxisNamed(axis.name);
    if (numbers.size() == image.axes.size() || (kind != AxisKind::kTime && kind != AxisKind::kChannel)) axes.push_back(&axis);
  }
  const auto usable = [&](double number) { return std::isfinite(number) && (member == &ImageAxis::start || number > 0); };
  const bool fits = numbers.size() == axes.size() || (numbers.size() == 3 && axes.size() > 3);
  if (!fits || !std::ranges::all_of(numbers, usable)) return false;
  for (std::size_t i = 0; i < numbers.size(); ++i) axes[axes.size() - numbers.size() + i]->*member = numbers[i];
  image.notes.push_back(fmt::format("the attribute {} gives {}", attribute, member == &ImageAxis::start ? "the origin" : "the spacing"));
  return true;
}

// Fiji and PlantSeg, funlib, CREMI: numbers in the order of the axes.
void TakeSizes(AttributedFile& file, const std::string& path, ImageDescription& image) {
  static constexpr std::pair<const char*, std::optional<LengthUnit>> kAttributes[] = {
      {"element_size_um", LengthUnit::kMicrometre}, {"voxel_size", std::nullopt}, {"resolution", std::nullopt}};
  for (const auto& [attribute, stated] : kAttributes) {
    if (!TakeNumbers(file, path, attribute, image, &ImageAxis::step)) continue;
    std::optional<LengthUnit> unit = stated;
    for (const char* const name : {"units", "unit"}) {
      const auto units = file.Texts(path, name);
      if (!unit && units) unit = LengthUnitNamed(units->back());
    }
    if (TakeNumbers(file, path, "offset", image, &ImageAxis::start)) image.world = World::kScene;
    for (ImageAxis& axis : image.axes) axis.unit = unit;
    return;
  }
}

// By the bounds of the cells around coordinates, where these are even.
std::optional<EvenSteps> CellsAround(AttributedFile& file, const std::string& scale, std::uint64_t size) {
  const std::optional<std::string> bounds = file.Text(scale, "bounds");
  if (!bounds) return std::nullopt;
  const Result<std::vector<double>> values = file.SmallDataset(scale.substr(0, scale.rfind('/') + 1) + *bounds);
  return values.ok() && values->size() == 2 * size ? EvenCellsOf(*values) : std::nullopt;
}

// Where cells or coordinates are even, they place the axis.
void TakeCoordinates(AttributedFile& file, const std::string& scale, std::uint64_t size, ImageAxis& axis, ImageDescription& image) {
  const AxisKind kind = AxisNamed(axis.name);
  if (scale.empty() || kind == AxisKind::kChannel) return;
  // netCDF writes a scale for each dimension, also where no variable has its coordinates.
  if (file.Text(scale, "NAME").value_or("").starts_with("This is a netCDF dimension but not a netCDF variable")) return;
  const Result<std::vector<double>> values = file.SmallDataset(scale);
  if (!values.ok() || values->size() != size) return;  // a dimension without coordinates, or names
  const std::string unit = file.Text(scale, "units").value_or(file.Text(scale, "unit").value_or(""));
  const std::string named = Printable(LastPart(scale) + (unit.empty() ? "" : " (" + unit + ")"));
  const bool down = file.Text(scale, "positive").value_or("") == "down";
  const std::optional<EvenSteps> cells = kind == AxisKind::kTime ? std::nullopt : CellsAround(file, scale, size);
  const std::optional<EvenSteps> even = cells ? cells : EvenStepsOf(*values);
  if (kind == AxisKind::kTime) {
    if (!even) return;
    axis.step = even->step;
    axis.time_unit = unit.substr(0, unit.find(' '));  // "hours since 2000-01-01"
    return;
  }
  if (!even && size > 1) {
    axis.uneven = *values;
    axis.uneven_named = named + (down ? " (running down)" : "");
    axis.unit = LengthUnitNamed(unit);
    return;
  }
  if (!even && !std::isfinite(values->front())) return;
  axis.start = even ? even->first : values->front();
  axis.step = even ? even->step : 1;
  axis.unit = LengthUnitNamed(unit);
  image.world = World::kScene;
  image.notes.push_back(fmt::format("{} {} place its axis: {:g} and steps of {:g}{}", cells ? "bounds of the coordinates" : "coordinates",
                                    named, axis.start, axis.step, down ? "; they run down" : ""));
}

}  // namespace

Result<ImageDescription> DescribeByAttributes(AttributedFile& file, const DatasetFacts& dataset, std::vector<std::string> scales) {
  const std::string& path = dataset.path;
  ImageDescription image{.format = file.format(), .axes = std::vector<ImageAxis>(dataset.size.size()), .labels = dataset.enumeration};
  const bool of_group = !scales.empty();
  if (!of_group) scales = file.DimensionScales(path);
  scales.resize(image.axes.size());
  const Result<bool> tagged = TakeAxistags(file, path, image);
  if (!tagged.ok()) return tagged.status();
  const std::vector<std::string> labels = file.Texts(path, "DIMENSION_LABELS").value_or(std::vector<std::string>{});
  for (std::size_t i = 0; i < image.axes.size() && !*tagged; ++i) {
    std::string& name = image.axes[i].name;
    name = NameOfScale(file, scales[i]);
    if (!name.empty()) image.axes_from = of_group ? "axes of their group" : "dimension scales";
    if (!name.empty() || i >= labels.size() || labels[i].empty()) continue;
    name = labels[i];
    image.axes_from = "labels of dimensions";
  }
  TakeSizes(file, path, image);
  for (std::size_t i = 0; i < image.axes.size(); ++i) TakeCoordinates(file, scales[i], dataset.size[i], image.axes[i], image);
  if (const auto others = file.Text(path, "coordinates"); others && image.world == World::kVoxels) {
    image.notes.push_back(fmt::format("coordinates '{}' have more than one axis and are not used", Printable(*others)));
  }
  DescribeValues(file, dataset, image);
  return image;
}

}  // namespace slabstream
