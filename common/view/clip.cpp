#include "common/view/clip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/view/world_limits.h"

namespace slabstream {
namespace {

// The least and the greatest distance of the points of a closed data-space box.
struct DistanceRange {
  double least, greatest;
};
DistanceRange DistancesOf(const HalfSpace& side, const Box& box) {
  const Vec3 centre = 0.5 * (ToVec3(box.begin + box.end) - Vec3{1, 1, 1}), half = 0.5 * ToVec3(box.size());
  const double middle = side.Distance(centre);
  const double reach = Dot(Absolute(side.normal), half);
  return {middle - reach, middle + reach};
}

// Of data space, from a plane of the world.
HalfSpace FromWorld(const ClipPlane& plane, const VolumeGeometry& geometry) {
  const double length = Length(plane.normal);
  const Vec3 normal = (1 / length) * plane.normal;
  return {geometry.orientation.FromWorld(normal) * geometry.spacing, Dot(normal, geometry.orientation.origin) + plane.offset / length};
}

Vec3 Unit(Axis axis) {
  Vec3 unit;
  unit[axis] = 1;
  return unit;
}

void AddBox(const ClipBox& box, const VolumeGeometry& geometry, std::vector<HalfSpace>& sides) {
  for (const Axis axis : kAxes) {
    for (const double sign : {1.0, -1.0}) {
      const double bound = sign > 0 ? box.low[axis] : box.high[axis];
      if (bound == -sign * kMaxCoordinate) continue;
      const Vec3 normal = sign * Unit(axis);
      if (box.unit == ClipUnit::kWorld) {
        sides.push_back(FromWorld({normal, -sign * bound}, geometry));
        continue;
      }
      // Voxel i fills [i - 0.5, i + 0.5) of voxel coordinates.
      const double position =
          box.unit == ClipUnit::kPercent ? bound / 100 * geometry.size[axis] - 0.5 : geometry.stretch.ToData(bound - 0.5, axis);
      sides.push_back({geometry.spacing[axis] * normal, -sign * geometry.spacing[axis] * position});
    }
  }
}

constexpr double kFarVoxels = 1e9;
static_assert(kFarVoxels > 4.0 * kMaxVolumeSide);

// Of a slice, in least distances of voxels: positions of samples are rounded by far less.
constexpr double kSliceThickness = 1.0 / 64;
// Of one of a rectilinear grid, in diagonals of the volume: less than the steps of rays (worker/rays/view_rays.h), more than their
// rounding.
constexpr double kLeastThickness = 0x1p-18;

void AddSlab(const ClipSlab& slab, const VolumeGeometry& geometry, std::vector<HalfSpace>& sides) {
  const Vec3 normal = Normalized(slab.normal), through = MiddleOf(slab, geometry);
  double thickness = kSliceThickness * geometry.least_distance();
  if (geometry.rectilinear()) thickness = std::max(thickness, kLeastThickness * Length(ToVec3(geometry.size) * geometry.spacing));
  const double half = 0.5 * std::max(slab.thickness, thickness);
  for (const double sign : {1.0, -1.0}) sides.push_back(FromWorld({sign * normal, half - sign * Dot(normal, through)}, geometry));
}

}  // namespace

Axis AxisAcross(const ClipSlab& slab, const VolumeGeometry& geometry) {
  const Vec3 normal = geometry.orientation.FromWorld(slab.normal);
  return *std::ranges::max_element(kAxes, {}, [&](Axis axis) { return std::abs(normal[axis]); });
}

Status CheckSlice(std::string_view name, const ClipSlab& slab, const VolumeGeometry& geometry) {
  const Axis axis = AxisAcross(slab, geometry);
  const std::int32_t last = geometry.size[axis] - 1;
  if (slab.index.value_or(0) <= last) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("{}.index is {}, but the volume has slices 0 to {} along {}", name, *slab.index, last, Letter(axis)));
}

Vec3 MiddleOf(const ClipSlab& slab, const VolumeGeometry& geometry) {
  Vec3 middle = geometry.centre();
  if (slab.index) {
    const Axis axis = AxisAcross(slab, geometry);
    middle[axis] = geometry.stretch.ToData(*slab.index, axis);
  }
  return slab.through.value_or(geometry.ToWorld(middle));
}

HalfSpace MiddlePlane(const ClipSlab& slab, const VolumeGeometry& geometry) {
  return FromWorld({slab.normal, -Dot(slab.normal, MiddleOf(slab, geometry))}, geometry);
}

bool ClipRegion::MayKeep(const Box& box) const {
  if (empty()) return true;
  // Renderers place samples in single precision.
  const auto slack = [](const HalfSpace& side) { return 0x1p-10 * Length(side.normal); };
  if (mode == ClipMode::kKeep) {
    return std::ranges::all_of(sides, [&](const HalfSpace& side) { return DistancesOf(side, box).greatest >= -slack(side); });
  }
  return std::ranges::any_of(sides, [&](const HalfSpace& side) { return DistancesOf(side, box).least <= slack(side); });
}

bool ClipRegion::KeepsAll(const Box& box, double margin) const {
  if (empty()) return true;
  if (mode == ClipMode::kKeep) {
    return std::ranges::all_of(sides, [&](const HalfSpace& side) { return DistancesOf(side, box).least >= margin; });
  }
  return std::ranges::any_of(sides, [&](const HalfSpace& side) { return DistancesOf(side, box).greatest <= -margin; });
}

Result<ClipRegion> MakeClipRegion(const Clipping& clipping, const VolumeGeometry& geometry) {
  ClipRegion region{{}, clipping.mode};
  if (clipping.box) AddBox(*clipping.box, geometry, region.sides);
  if (clipping.slab) {
    if (Status status = CheckSlice("clip.slab", *clipping.slab, geometry); !status.ok()) return status;
    AddSlab(*clipping.slab, geometry, region.sides);
  }
  for (const ClipPlane& plane : clipping.planes) region.sides.push_back(FromWorld(plane, geometry));
  // A plane that is farther away than any voxel can be is as far as it needs to be: renderers compute in single precision.
  for (HalfSpace& side : region.sides) {
    const double farthest = kFarVoxels * Length(side.normal);
    side.offset = std::clamp(side.offset, -farthest, farthest);
  }
  if (region.mode == ClipMode::kKeep) {
    std::erase_if(region.sides, [&](const HalfSpace& side) { return DistancesOf(side, geometry.bounds()).least >= 0; });
  }
  return region;
}

}  // namespace slabstream
