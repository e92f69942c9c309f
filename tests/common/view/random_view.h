// Volumes and views drawn at random.
#pragma once

#include <cmath>
#include <numbers>

#include "common/view/camera.h"
#include "tests/common/view/view_limits.h"
#include "tests/support/random.h"

namespace slabstream {

// Three right-handed unit vectors at right angles.
inline std::array<Vec3, 3> RandomAxes(Random& random) {
  const auto direction = [&] { return Normalized(Vec3{random.Real(-1, 1), random.Real(-1, 1), random.Real(-1, 1)}); };
  const Vec3 x = direction();
  Vec3 z = Cross(x, direction());
  while (Length(z) < 1e-3) z = Cross(x, direction());
  z = Normalized(z);
  return {x, Cross(z, x), z};
}

inline VolumeGeometry RandomGeometry(Random& random, World world = World::kPatient) {
  VolumeGeometry geometry = {{random.Integer(1, 90), random.Integer(1, 90), random.Integer(1, 90)},
                             {random.Real(0.1, 4), random.Real(0.1, 4), random.Real(0.1, 4)}};
  geometry.orientation = {world, {random.Real(-100, 100), random.Real(-100, 100), random.Real(-100, 100)}, RandomAxes(random)};
  return geometry;
}

// Looks at the centre of any volume.
inline ViewParameters RandomView(Random& random) {
  ViewParameters view;
  view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  view.azimuth_degrees = random.Real(-400, 400);
  view.elevation_degrees = random.Real(-90, 90);
  view.roll_degrees = random.Real(-180, 180);
  view.zoom = std::exp(random.Real(-2, 2));
  view.fov_degrees = random.Real(kMinFovDegrees, kMaxFovDegrees);
  return view;
}

// A view that CheckView takes: of the volume's centre, or of a point nearby.
inline ViewParameters RandomViewOf(const VolumeGeometry& volume, Random& random) {
  for (;;) {
    ViewParameters view = RandomView(random);
    const Vec3 voxel = {random.Real(0, volume.size.x), random.Real(0, volume.size.y), random.Real(0, volume.size.z)};
    if (random.Chance(0.5)) view.look_at = volume.orientation.origin + volume.orientation.ToWorld(volume.spacing * voxel);
    if (CheckView(view, volume).ok()) return view;
  }
}

}  // namespace slabstream
