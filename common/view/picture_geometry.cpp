#include "common/view/picture_geometry.h"

namespace slabstream {

LengthUnit UnitOf(const VolumeGeometry& volume) {
  if (volume.orientation.unit) return *volume.orientation.unit;
  if (volume.orientation.world == World::kPatient) return LengthUnit::kMillimetre;
  const bool bare = volume.orientation.world == World::kVoxels && volume.spacing == Vec3{1, 1, 1};
  return bare ? LengthUnit::kVoxel : LengthUnit::kFile;
}

PictureGeometry GeometryOf(const Camera& camera, const VolumeGeometry& volume) {
  const Orientation& orientation = volume.orientation;
  const Vec3 eye = camera.eye * volume.spacing;
  PictureGeometry geometry;
  geometry.world = orientation.world;
  geometry.unit = UnitOf(volume);
  geometry.projection = camera.projection;
  geometry.right = orientation.ToWorld(camera.right);
  geometry.up = orientation.ToWorld(camera.up);
  geometry.forward = orientation.ToWorld(camera.view_direction);
  geometry.target = orientation.origin + orientation.ToWorld(eye + camera.target_depth * camera.view_direction);
  geometry.target_depth = camera.target_depth;
  geometry.pixel_size = camera.PixelSizeAt(camera.target_depth);
  geometry.box_corner = volume.ToWorld({-0.5, -0.5, -0.5});
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    geometry.box_edges[i] = volume.size[axis] * volume.spacing[axis] * orientation.axes[i];
  }
  return geometry;
}

}  // namespace slabstream
