// RequiredHalo against the footprint's definition: a voxel whose footprint covers a pixel lies within the halo of the place where the
// pixel's ray meets the voxel's slice.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/view/camera.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

struct Extent {
  double x, y;  // pixels to each side
};

// By differences of projections, unlike the code under test.
Extent FootprintAt(const Camera& camera, const Vec3& q) {
  double xx = 0, yy = 0, xy = 0;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr double kStep = 1e-4;
    Vec3 low = q, high = q;
    low[axis] -= kStep;
    high[axis] += kStep;
    const auto a = camera.Project(low), b = camera.Project(high);
    const double dx = (b.x - a.x) / (2 * kStep), dy = (b.y - a.y) / (2 * kStep);
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  return {3 * std::sqrt(0.36 * (xx + std::abs(xy)) + 0.2), 3 * std::sqrt(0.36 * (yy + std::abs(xy)) + 0.2)};
}

// Where the cell of coordinate i along an axis of n voxels has its centre.
double CellCentre(double i, int n) {
  const double begin = std::floor(i / kFootprintCell) * kFootprintCell;
  return (begin + std::min<double>(begin + kFootprintCell, n) - 1) / 2;
}

TEST(RequiredHalo, HoldsEveryVoxelThatReachesAnOwnedSample) {
  Random random(21);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 400; ++i) {
    const VolumeGeometry geometry = {{random.Integer(1, 300), random.Integer(1, 300), random.Integer(1, 300)},
                                     {random.Real(0.3, 3), random.Real(0.3, 3), random.Real(0.3, 3)}};
    ViewParameters view;
    view.projection = random.Chance(0.3) ? Projection::kOrthographic : Projection::kPerspective;
    view.azimuth_degrees = random.Real(0, 360);
    view.elevation_degrees = random.Real(-90, 90);
    view.roll_degrees = random.Real(0, 360);
    view.zoom = std::exp(random.Real(-3, 2));
    view.fov_degrees = random.Real(kMinFovDegrees, kMaxFovDegrees);
    const Camera camera = MakeCamera(view, {random.Integer(16, 512), random.Integer(16, 512)}, geometry);
    const int halo = RequiredHalo(camera, geometry);
    EXPECT_EQ(halo % kHaloStep, 0);
    EXPECT_GE(halo, kHaloStep);

    const int c = Number(camera.traversal_axis), u = c == 0 ? 1 : 0, v = c == 2 ? 1 : 2;
    for (int sample = 0; sample < 50; ++sample) {
      // A voxel, half of them at corners of the volume, and the corners of its footprint traced back to its slice.
      Vec3 q;
      for (int axis = 0; axis < 3; ++axis) {
        const int last = geometry.size[axis] - 1;
        q[axis] = sample % 2 == 0 ? (random.Chance(0.5) ? last : 0) : random.Integer(0, last);
      }
      Vec3 cell = q;
      if (view.projection == Projection::kPerspective) {
        cell[u] = CellCentre(q[u], geometry.size[u]);
        cell[v] = CellCentre(q[v], geometry.size[v]);
      }
      const Extent extent = FootprintAt(camera, cell);
      const auto centre = camera.Project(q);
      for (int corner = 0; corner < 4; ++corner) {
        const auto ray = camera.RayAt(centre.x + (corner & 1 ? extent.x : -extent.x), centre.y + (corner & 2 ? extent.y : -extent.y));
        const double t = (q[c] - ray.origin[c]) / ray.direction[c];
        const Vec3 hit = ray.origin + t * ray.direction;
        // What lies outside the volume belongs to the boxes at the rim.
        const auto distance = [&](int axis) { return std::abs(std::clamp(hit[axis], -0.5, geometry.size[axis] - 0.5) - q[axis]); };
        EXPECT_LE(std::max(distance(u), distance(v)) + 1, halo);  // one voxel more for gradients
      }
    }
  }
}

TEST(RequiredHalo, UsualViewsNeedOneStep) {
  // 512 pixels for a volume of this size: less than one pixel a voxel.
  const VolumeGeometry geometry = {{301, 370, 316}, {1, 1, 1}};
  for (int azimuth = 0; azimuth < 360; azimuth += 15) {
    for (int elevation = -90; elevation <= 90; elevation += 15) {
      ViewParameters view;
      view.azimuth_degrees = azimuth;
      view.elevation_degrees = elevation;
      EXPECT_EQ(RequiredHalo(MakeCamera(view, {512, 512}, geometry), geometry), kHaloStep) << azimuth << ", " << elevation;
    }
  }
}

TEST(RequiredHalo, IsBoundedByTheVolume) {
  ViewParameters view;
  view.zoom = kMinZoom;
  const VolumeGeometry geometry = {{65535, 10, 10}, {1, 1, 1}};
  EXPECT_LE(RequiredHalo(MakeCamera(view, {1, 1}, geometry), geometry), 65536);
}

}  // namespace
}  // namespace slabstream
