// PictureGeometry: how a finished picture shows the world of its volume. It travels with the picture, so that whoever has the picture can
// draw a scale, name its sides and find the point behind a pixel, wherever the picture was made.
//
// The point of the world at (x, y) of the picture, in pixels from its upper left corner, and at depth d (camera.h) is
//   target + (d - target_depth) forward + k pixel_size ((x - width / 2) right - (y - height / 2) up)
// with k = 1 for orthographic pictures and k = d / target_depth for perspective ones.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "common/view/camera.h"
#include "common/volume/orientation.h"

namespace slabstream {

// Of lengths in a volume's world.
enum class LengthUnit : std::uint8_t {
  kVoxel = 1,       // nothing is known: the distance of neighbouring voxels
  kFile = 2,        // of the file's spacing, which states none
  kMillimetre = 3,  // of patients
};
inline constexpr std::array<std::string_view, 3> kLengthUnitNames = {"voxel", "unknown", "mm"};  // in records and answers
constexpr std::string_view NameOf(LengthUnit unit) { return kLengthUnitNames.at(std::size_t(unit) - 1); }

struct PictureGeometry {
  World world = World::kVoxels;  // whose axes these are
  LengthUnit unit = LengthUnit::kVoxel;
  Projection projection = Projection::kOrthographic;
  // Unit vectors at right angles, along the world's axes: to the right and upwards in the picture, and away from the viewer.
  Vec3 right = {1, 0, 0}, up = {0, 0, 1}, forward = {0, 1, 0};
  Vec3 target;              // the point that the picture's centre shows
  double target_depth = 1;  // perspective: > 0
  double pixel_size = 1;    // > 0: side of a pixel at the target's depth; in orthographic pictures at any depth
  friend bool operator==(const PictureGeometry&, const PictureGeometry&) = default;
};

// Of the finished picture, without supersampling. `camera` is of a view of `volume`.
PictureGeometry GeometryOf(const Camera& camera, const VolumeGeometry& volume);

}  // namespace slabstream
