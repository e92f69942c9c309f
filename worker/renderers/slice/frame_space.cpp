#include "worker/renderers/slice/frame_space.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream::slice {
namespace {

Vec3 ToVec3(const Float3& v) { return {double(v[0]), double(v[1]), double(v[2])}; }
Float3 ToFloat3(const Vec3& v) { return {float(v.x), float(v.y), float(v.z)}; }
Vec3 Linear(const std::array<double, 4>& row) { return {row[0], row[1], row[2]}; }

// Parts of the distance by which samples are moved along x, y and depth. Neither they nor their sums and differences are nearly 0, so
// samples also leave the planes of a grid that is seen along a diagonal.
constexpr double kAlongX = 0.3517, kAlongY = 0.5561, kAlongDepth = 1.2943;

}  // namespace

FrameSpace::FrameSpace(const Camera& camera, const VolumeGeometry& geometry, double planes_per_voxel, const ClipRegion& clip)
    : camera_(camera),
      rays_(OnPlanes(MakeViewRays(camera, geometry, planes_per_voxel, clip))),
      perspective_(camera.projection == Projection::kPerspective),
      step_(double(rays_.step)),
      first_(ToVec3(rays_.start)) {
  // More than the error of the rays' positions, which decide which box owns a sample.
  const double move = 0x1p-19 * std::max({geometry.size.x, geometry.size.y, geometry.size.z});
  moved_ = 2 * move;
  const double physical = move * Least(geometry.spacing), middle = camera.Project(geometry.centre()).depth;
  const double pixel = std::sqrt(double(rays_.pixel_squared)) * (perspective_ ? middle : 1);
  move_x_ = kAlongX * physical / pixel;
  move_y_ = kAlongY * physical / pixel;
  move_k_ = kAlongDepth * physical / step_;
  first_depth_ = camera.Project(first_).depth + move_k_ * step_;
  numerator_ = middle * middle / step_;  // then s changes by about 1 from plane to plane

  const Vec3 across = move_x_ * ToVec3(rays_.right) + move_y_ * ToVec3(rays_.down), forward = ToVec3(rays_.forward);
  const double distance = double(rays_.start_distance) + move_k_ * step_;
  rays_.start_distance = float(distance);
  rays_.start = ToFloat3(first_ + (perspective_ ? distance : 1) * across + move_k_ * step_ * forward);
  if (perspective_) rays_.forward = ToFloat3(forward + across);
}

FramePoint FrameSpace::At(const Vec3& point) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const Camera::ImagePoint at = camera_.Project(point);
  if (perspective_ && !(at.depth > 0)) return {kNone, kNone, kNone, kNone};
  // Relative to plane 0, so that nothing cancels if the eye is far away.
  const double k = Dot(Linear(camera_.depth_row), point - first_) / step_ - move_k_;
  return {at.x - 0.5 - move_x_, at.y - 0.5 - move_y_, perspective_ ? numerator_ / at.depth : k, k};
}

AlignedVector<FramePoint> FrameSpace::At(std::span<const Vector3<float>> points) const {
  AlignedVector<FramePoint> result(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 4096), [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      result[i] = At({double(points[i].x), double(points[i].y), double(points[i].z)});
    }
  });
  return result;
}

RayReach FrameSpace::ReachOf(const Vec3& low, const Vec3& high) const {
  const Vec3 slack = {moved_, moved_, moved_};
  return ReachOfBox(rays_, camera_, low - slack, high + slack);
}

}  // namespace slabstream::slice
