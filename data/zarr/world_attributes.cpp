#include "data/zarr/world_attributes.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace slabstream::zarr {
namespace {

using metadata::Field;

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

}  // namespace

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

}  // namespace slabstream::zarr
