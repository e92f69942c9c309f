// Where a volume lies in world space: world = origin + sum over axes of axes[i] * spacing[i] * voxel[i].
//
// Readers turn what they read to the nearest axes of its world (data/volume_io/world_placement.h). So x, y and z of voxels always run
// roughly along x, y and z of the world, in any order and direction of storage in a file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/math/vec.h"

namespace slabstream {

enum class World : std::uint8_t {
  kVoxels = 1,   // no orientation is known: x, y and z are those of the voxels, in the unit of the spacing
  kScene = 2,    // axes of the file's own, right-handed
  kPatient = 3,  // x to the patient's right, y to anterior, z to superior (RAS); mm unless stated
};
constexpr std::string_view NameOf(World world) { return world == World::kVoxels ? "voxels" : world == World::kScene ? "scene" : "patient"; }

// The units of lengths in a world.
enum class LengthUnit : std::uint8_t {
  kVoxel = 1,       // nothing is known: the distance of neighbouring voxels
  kFile = 2,        // the unit of the file's spacing, for which the file states no name
  kMillimetre = 3,  // the unit of patients, and of files that state it, like those below
  kMicrometre = 4,
  kNanometre = 5,
  kAngstrom = 6,
  kCentimetre = 7,
  kMetre = 8,
};
inline constexpr std::array<std::string_view, 8> kLengthUnitNames = {"voxel", "unknown", "mm", "\u00b5m",
                                                                     "nm",    "\u00c5",  "cm", "m"};  // in records and answers; UTF-8
constexpr std::string_view NameOf(LengthUnit unit) { return kLengthUnitNames.at(std::size_t(unit) - 1); }
// As it stands behind a number.
constexpr std::string_view PluralOf(LengthUnit unit) {
  return unit == LengthUnit::kVoxel ? "voxels" : unit == LengthUnit::kFile ? "units" : NameOf(unit);
}

struct Orientation {
  World world = World::kVoxels;
  Vec3 origin;                                                               // the centre of voxel 0, 0, 0; finite
  std::array<Vec3, 3> axes = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};  // unit, at right angles, right-handed
  // The world's unit, as the file states it: kMillimetre or below in the list. None: it states none, or a patient's mm.
  std::optional<LengthUnit> unit = {};

  // A direction of the world as seen from the voxels' axes, and back. Lengths stay.
  Vec3 FromWorld(const Vec3& direction) const { return {Dot(axes[0], direction), Dot(axes[1], direction), Dot(axes[2], direction)}; }
  Vec3 ToWorld(const Vec3& direction) const { return direction.x * axes[0] + direction.y * axes[1] + direction.z * axes[2]; }

  friend bool operator==(const Orientation&, const Orientation&) = default;
};

}  // namespace slabstream
