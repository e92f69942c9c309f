// RequiredHalo. Legend: q a point of the volume; u, v the axes of a slice, c the traversal axis; J the derivative of image coordinates by
// data coordinates at q; a footprint reaches kCutSigmas standard deviations to each side in x and in y.

#include <algorithm>
#include <array>
#include <cmath>

#include "common/view/camera.h"

namespace slabstream {
namespace {

struct Jacobian {
  std::array<double, 3> x{}, y{};  // pixels a voxel, by data axis
};

Jacobian JacobianAt(const Camera& camera, const Vec3& q) {
  const auto apply = [&](const std::array<double, 4>& row) { return row[0] * q.x + row[1] * q.y + row[2] * q.z + row[3]; };
  const double w = apply(camera.w_row), x = apply(camera.x_row) / w, y = apply(camera.y_row) / w;
  Jacobian j;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    j.x[axis] = (camera.x_row[axis] - x * camera.w_row[axis]) / w;
    j.y[axis] = (camera.y_row[axis] - y * camera.w_row[axis]) / w;
  }
  return j;
}

struct ScreenReach {
  double x, y;  // pixels
};

ScreenReach FootprintReach(const Jacobian& j) {
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    xx += j.x[axis] * j.x[axis];
    yy += j.y[axis] * j.y[axis];
    xy += j.x[axis] * j.y[axis];
  }
  const double correlation = kFootprintVoxelVariance * std::abs(xy);
  return {kFootprintCut * std::sqrt(kFootprintVoxelVariance * xx + correlation + kFootprintPixelVariance),
          kFootprintCut * std::sqrt(kFootprintVoxelVariance * yy + correlation + kFootprintPixelVariance)};
}

// Reach, in voxels along u or v, of the widest footprint near q.
double SliceReach(const Camera& camera, const Vec3& q, const Vec3& low, const Vec3& high) {
  const auto c = std::size_t(Number(camera.traversal_axis));
  const std::size_t u = c == 0 ? 1 : 0, v = c == 2 ? 1 : 2;
  const Jacobian at_q = JacobianAt(camera, q);
  ScreenReach reach = FootprintReach(at_q);
  if (camera.projection == Projection::kPerspective) {
    // A footprint's shape is that of its cell's centre, which is at most half a cell away.
    for (double du : {-0.5, 0.5}) {
      for (double dv : {-0.5, 0.5}) {
        Vec3 near = q;
        near[int(u)] = std::clamp(q[int(u)] + du * kFootprintCell, low[int(u)], high[int(u)]);
        near[int(v)] = std::clamp(q[int(v)] + dv * kFootprintCell, low[int(v)], high[int(v)]);
        const ScreenReach other = FootprintReach(JacobianAt(camera, near));
        reach = {std::max(reach.x, other.x), std::max(reach.y, other.y)};
      }
    }
  }
  // Back from the image to the slice: the inverse of the (u, v) part of J.
  const double determinant = std::abs(at_q.x[u] * at_q.y[v] - at_q.x[v] * at_q.y[u]);
  const double along_u = (std::abs(at_q.y[v]) * reach.x + std::abs(at_q.x[v]) * reach.y) / determinant;
  const double along_v = (std::abs(at_q.y[u]) * reach.x + std::abs(at_q.x[u]) * reach.y) / determinant;
  return std::max(along_u, along_v);
}

}  // namespace

int RequiredHalo(const Camera& camera, const VolumeGeometry& geometry) {
  const Vec3 low = {-0.5, -0.5, -0.5};
  const Vec3 high = ToVec3(geometry.size) + low;
  double reach = 0;
  if (camera.projection == Projection::kOrthographic) {
    reach = SliceReach(camera, low, low, high);  // the same everywhere
  } else {
    // Reach grows with depth and with the angle between ray and traversal axis, so its largest value is at a corner of the volume.
    for (double x : {low.x, high.x}) {
      for (double y : {low.y, high.y}) {
        for (double z : {low.z, high.z}) reach = std::max(reach, SliceReach(camera, {x, y, z}, low, high));
      }
    }
  }
  constexpr double kGradient = 1, kRounding = 1;  // voxels
  const double largest_side = std::max({geometry.size.x, geometry.size.y, geometry.size.z});
  const double needed = std::min(reach + kGradient + kRounding, largest_side);
  return int(std::ceil(needed / kHaloStep)) * kHaloStep;
}

}  // namespace slabstream
