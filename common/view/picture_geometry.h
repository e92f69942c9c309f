// PictureGeometry: how a finished picture shows the world of its volume. It travels with the picture, so that whoever has the picture can
// draw a scale, name its sides and find the point behind a pixel, wherever the picture was made.
//
// The point of the world at (x, y) of the picture, in pixels from its upper left corner, and at depth d (camera.h) is
//   target + (d - target_depth) forward + k pixel_size ((x - width / 2) right - (y - height / 2) up)
// with k = 1 for orthographic pictures and k = d / target_depth for perspective ones.
#pragma once

#include <array>

#include "common/view/camera.h"
#include "common/volume/orientation.h"

namespace slabstream {

struct PictureGeometry {
  World world = World::kVoxels;  // the world whose axes these are
  LengthUnit unit = LengthUnit::kVoxel;
  Projection projection = Projection::kOrthographic;
  // Unit vectors at right angles, along the world's axes: to the right and upwards in the picture, and away from the viewer.
  Vec3 right = {1, 0, 0}, up = {0, 0, 1}, forward = {0, 1, 0};
  Vec3 target;              // the point that the picture's centre shows
  double target_depth = 1;  // perspective: > 0
  double pixel_size = 1;    // > 0: side of a pixel at the target's depth; in orthographic pictures at any depth
  // The volume's box, its outer faces: the corner where the axes of its voxels begin, and from there the edges along them. Zero: not known.
  Vec3 box_corner;
  std::array<Vec3, 3> box_edges;
  friend bool operator==(const PictureGeometry&, const PictureGeometry&) = default;
};

// The unit of lengths in the volume's world.
LengthUnit UnitOf(const VolumeGeometry& volume);

// The geometry of the finished picture, without supersampling. `camera` is of a view of `volume`.
PictureGeometry GeometryOf(const Camera& camera, const VolumeGeometry& volume);

}  // namespace slabstream
