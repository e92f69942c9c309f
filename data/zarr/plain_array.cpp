#include "data/zarr/plain_array.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/printable.h"
#include "common/text/base64.h"
#include "common/volume/volume.h"
#include "data/sources/array_numbers.h"
#include "data/sources/mapped_array.h"
#include "data/volume_io/even_steps.h"
#include "data/volume_io/length_names.h"
#include "data/volume_io/stated_field.h"
#include "data/zarr/find_volume.h"

namespace slabstream::zarr {
namespace {

using metadata::Field;

// Names of all axes of the metadata, "" where there is none.
Result<std::vector<std::string>> NamesOfAxes(const ZarrArray& array, const ZarrNode& node) {
  std::vector<std::string> names(array.from.size());
  for (std::size_t i = 0; i < array.dimension_names.size(); ++i) names[array.from[i]] = array.dimension_names[i];
  const Field xarray = node.attributes_field()["_ARRAY_DIMENSIONS"];
  if (!array.dimension_names.empty() || !xarray.given()) return names;
  if (!xarray.is_array() || xarray.size() != names.size()) return xarray.Wrong(fmt::format("a list of {} names", names.size()));
  for (std::size_t axis = 0; axis < names.size(); ++axis) {
    const Result<std::string> name = xarray[axis].Text();
    if (!name.ok()) return name.status();
    names[axis] = *name;
  }
  return names;
}

// Says so where an axis is not called what it is taken for.
void NoteAxes(const std::vector<std::string>& names, const std::vector<AxisKind>& kinds, SourceInfo& info) {
  std::vector<std::string_view> as;
  for (const AxisKind kind : kinds) as.push_back(NameOf(kind));
  const auto same = [](const std::string& name, AxisKind kind) { return AxisNamed(name) == kind; };
  if (std::ranges::equal(names, kinds, same)) return;
  const bool named = std::ranges::any_of(names, [](const std::string& name) { return !name.empty(); });
  info.notes.push_back(named ? Printable(fmt::format("the axes {} are taken for {}", fmt::join(names, ", "), fmt::join(as, ", ")))
                             : fmt::format("the axes have no names; in their order they are taken for {}", fmt::join(as, ", ")));
}

// Coordinates of an array's axes, as xarray keeps them: beside the array, each in an array of one axis that is called like it.
struct AxisCoordinates {
  std::vector<double> values;  // one for each index along the axis
  std::string unit;            // "m"; "": none is stated
  std::string bounds;          // the array with those of their cells; "": there is none
};

// Those in the array `name` of a group that has one axis of `size` elements; or, of bounds, `each` numbers for each of them along a second
// axis. nullopt: there is no such array, or it holds no numbers. Errors of reading its chunks. Waits.
Result<std::optional<AxisCoordinates>> ReadCoordinates(const ArrayContext& context, const std::string& group, const std::string& name,
                                                       std::uint64_t size, std::uint64_t each = 1) {
  const std::optional<AxisCoordinates> none;
  if (name.empty() || name.find('/') != std::string::npos || size > std::uint64_t(kMaxVolumeSide)) return none;
  const Result<std::optional<ZarrNode>> node = NodeReading(*context.store, metadata::Join(group, name)).Get();
  if (!node.ok() || !node->has_value() || !(*node)->array) return none;
  const Result<ZarrArray> opened = OpenArray(context, **node);
  if (!opened.ok()) return none;
  const ArrayShape& shape = opened->array->shape();
  constexpr std::uint64_t kMostChunks = 1024;
  const std::vector<std::uint64_t> all = each == 1 ? std::vector{size} : std::vector{size, each};
  if (SizesInMetadata(*opened) != all || opened->from.front() != 0 || (size - 1) / shape.chunk[0] >= kMostChunks) return none;
  const auto values =
      ReadNumbers<double>(NameOf(*context.store, (*node)->path), opened->array, {std::vector<std::uint64_t>(all.size()), all});
  if (!values.ok()) return values.status();
  AxisCoordinates coordinates{.values = {values->begin(), values->end()}};
  const metadata::Field attributes = (*node)->attributes_field();
  for (const char* const key : {"units", "unit"}) {
    if (const metadata::Field unit = attributes[key]; unit.is_text()) coordinates.unit = *unit.Text();
  }
  if (const metadata::Field bounds = attributes["bounds"]; bounds.is_text()) coordinates.bounds = *bounds.Text();
  return std::optional(std::move(coordinates));
}

// Spacing, origin, unit and times by coordinates that lie beside the array.
Status PlaceByCoordinates(const ArrayContext& context, const ZarrNode& node, const std::vector<std::string>& names,
                          const std::vector<AxisKind>& kinds, const ChosenAxes& choice, const std::vector<std::uint64_t>& sizes,
                          const ReadOptions& options, Pyramid& pyramid) {
  const std::size_t slash = node.path.rfind('/');
  if (node.path.empty()) return Status::Ok();
  const std::string group = slash == std::string::npos ? "" : node.path.substr(0, slash);
  PyramidLevel& level = pyramid.levels.front();
  if (const auto time = std::ranges::find(kinds, AxisKind::kTime); time != kinds.end() && choice.times > 1) {
    const auto number = std::size_t(time - kinds.begin());
    const Result<std::optional<AxisCoordinates>> coordinates = ReadCoordinates(context, group, names[number], sizes[number]);
    if (coordinates.ok() && *coordinates) {
      const auto& [values, unit, bounds] = **coordinates;
      pyramid.info.times = StatedTimes(choice.times, values, unit.substr(0, unit.find(' ')));  // "hours since 2000-01-01"
    }
  }
  std::vector<std::string> placed, units;
  for (const Axis axis : kAxes) {
    const int number = choice.axes[std::size_t(axis)];
    if (number < 0) continue;
    const std::string& name = names[std::size_t(number)];
    const Result<std::optional<AxisCoordinates>> coordinates = ReadCoordinates(context, group, name, sizes[std::size_t(number)]);
    if (!coordinates.ok()) return coordinates.status();
    if (!*coordinates) continue;
    const std::vector<double>& values = (*coordinates)->values;
    const auto bounds = ReadCoordinates(context, group, (*coordinates)->bounds, values.size(), 2);
    if (!bounds.ok()) return bounds.status();
    const std::optional<EvenSteps> cells = *bounds ? EvenCellsOf((*bounds)->values) : std::nullopt;
    if (values.size() < 2 && !cells) continue;
    const auto [first, step] = cells ? *cells : MeanSteps(values);
    const bool falls = step < 0;
    if (!cells && !EvenStepsOf(values)) {
      const Result<UnevenAxis> uneven = UnevenAxisOf(Printable(node.path + ": coordinates " + name), values, ValuesAt::kPoints);
      if (!options.resample && (options.labels || !uneven.ok())) {
        pyramid.info.notes.push_back(
            Printable(fmt::format("the coordinates of {} are not evenly spaced ({}), so its spacing is 1", name, WhyUneven(values))));
        continue;
      }
      if (!uneven.ok()) return uneven.status();
      pyramid.info.uneven[std::size_t(axis)] = falls ? uneven->Reversed() : *uneven;
    }
    level.mirrored[std::size_t(axis)] = falls;
    level.spacing[axis] = std::abs(step);
    level.origin[axis] = falls ? first + step * double(values.size() - 1) : first;
    placed.push_back(cells ? (*coordinates)->bounds : name);
    units.push_back((*coordinates)->unit);
  }
  if (!placed.empty())
    pyramid.info.notes.push_back(Printable(fmt::format("spacing and origin are those of the coordinates {}", fmt::join(placed, ", "))));
  if (units.empty()) return Status::Ok();
  if (std::ranges::count(units, units.front()) == std::ptrdiff_t(units.size())) {
    pyramid.orientation.unit = LengthUnitNamed(units.front());
  } else {
    pyramid.info.notes.push_back(Printable(fmt::format("the units of the coordinates differ: {}", fmt::join(units, ", "))));
  }
  return Status::Ok();
}

// A number, or a list of one, as netCDF has them.
std::optional<double> NumberOf(const Field& field) {
  const Field one = field.is_array() && field.size() == 1 ? field[0] : field;
  const Result<double> number = one.Number();
  return number.ok() ? std::optional(*number) : std::nullopt;
}

// xarray writes _FillValue of floats as the bytes of a double in base64 into Zarr 3.
std::optional<double> MissingValueOf(const Field& field) {
  constexpr std::size_t kTextBytes = 12;
  if (!field.is_text() || field.value().text().size() != kTextBytes) return NumberOf(field);
  const std::string text = *field.Text();
  std::array<std::byte, kTextBytes / 4 * 3> bytes{};
  double value = 0;
  if (DecodeBase64(std::as_bytes(std::span(text)), bytes) != sizeof value) return std::nullopt;
  std::memcpy(&value, bytes.data(), sizeof value);  // stored lowest byte first
  return std::isnan(value) ? std::nullopt : std::optional(value);
}

// What the CF conventions say of values.
Status UnpackValues(const ZarrNode& node, ZarrArray& array, Pyramid& pyramid) {
  const Field attributes = node.attributes_field();
  const Field scale = attributes["scale_factor"], offset = attributes["add_offset"];
  if (scale.given() || offset.given()) {
    pyramid.rescale = {NumberOf(scale).value_or(1), NumberOf(offset).value_or(0)};
    if (scale.given() && (!NumberOf(scale) || pyramid.rescale.scale == 0)) return scale.Wrong("a number other than 0");
    if (offset.given() && !NumberOf(offset)) return offset.Wrong("a number");
    pyramid.info.notes.push_back(
        fmt::format("values are scale_factor {:g} * stored + add_offset {:g}", pyramid.rescale.scale, pyramid.rescale.offset));
  }
  std::optional<double> missing = MissingValueOf(attributes["_FillValue"]);
  if (!missing) missing = NumberOf(attributes["missing_value"]);
  // The fill value of the array itself, which xarray takes for it in version 2, is what other writers store as a value, too.
  if (!missing) return Status::Ok();
  pyramid.info.file_type = ToString(array.array->shape().type);
  array.array = MakeMappedArray(array.array, {.missing = {*missing}});
  pyramid.info.notes.push_back(fmt::format("stored values of {:g} mean that there is none (NaN)", *missing));
  return Status::Ok();
}

}  // namespace

PyramidLevel LevelOf(const ZarrArray& array, const ChosenAxes& choice) {
  PyramidLevel level{.array = array.array};
  for (const std::size_t axis : array.from) level.at.push_back(choice.at[axis]);
  const auto place = [&](int axis) { return axis < 0 ? -1 : int(std::ranges::find(array.from, std::size_t(axis)) - array.from.begin()); };
  std::ranges::transform(choice.axes, level.axes.begin(), place);
  level.time_axis = place(choice.time_axis);
  level.channel_axis = place(choice.channel_axis);
  return level;
}

std::vector<std::uint64_t> SizesInMetadata(const ZarrArray& array) {
  std::vector<std::uint64_t> sizes(array.from.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) sizes[array.from[i]] = array.array->shape().size[i];
  return sizes;
}

Result<Pyramid> PyramidOfArray(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options) {
  const std::string name = NameOf(*context.store, node.path);
  Result<ZarrArray> array = OpenArray(context, node);
  if (!array.ok()) return array.status();
  const Result<std::vector<std::string>> names = NamesOfAxes(*array, node);
  if (!names.ok()) return names.status();
  const Result<std::vector<AxisKind>> kinds = KindsOfPlainAxes(name, *names, options);
  if (!kinds.ok()) return kinds.status();
  const std::vector<std::uint64_t> sizes = SizesInMetadata(*array);
  const Result<ChosenAxes> choice = ChooseAxes(name, *kinds, sizes, options);
  if (!choice.ok()) return choice.status();
  Pyramid pyramid;
  pyramid.info.format = fmt::format("Zarr {}", node.version);
  choice->Describe(pyramid.info);
  NoteAxes(*names, *kinds, pyramid.info);
  if (Status status = UnpackValues(node, *array, pyramid); !status.ok()) return status;
  pyramid.levels.push_back(LevelOf(*array, *choice));
  if (options.spacing) {
    pyramid.levels.back().spacing = *options.spacing;
    return pyramid;
  }
  if (Status status = PlaceByCoordinates(context, node, *names, *kinds, *choice, sizes, options, pyramid); !status.ok()) return status;
  return pyramid;
}

}  // namespace slabstream::zarr
