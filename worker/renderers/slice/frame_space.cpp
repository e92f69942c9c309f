#include "worker/renderers/slice/frame_space.h"

#include <algorithm>
#include <cmath>

#include "common/parallel/parallel.h"

namespace slabstream::slice {
namespace {

Vec3 ToVec3(const Float3& v) { return {double(v[0]), double(v[1]), double(v[2])}; }
Vec3 Linear(const std::array<double, 4>& row) { return {row[0], row[1], row[2]}; }

// By which part of the distance samples are moved along x, y and depth. No sum or difference of them is near 0, so samples leave the
// planes of a grid also if it is seen along a diagonal.
constexpr double kAlongX = 0.3517, kAlongY = 0.5561, kAlongDepth = 1.2943;

constexpr double kSlack = 1e-6;  // covers the rounding of a face's place; without it a sample near a corner might get lost

// The first whole number that is not less.
float WholeFrom(double value) { return float(std::ceil(std::min(std::max(value, -0x1p23), 0x1p23))); }

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

void FrameSpace::Place(const Vec3& point, FramePoint& at, PointBounds& bounds) const {
  const Camera::ImagePoint image = camera_.Project(point);
  bounds = {};
  at = {};
  if (perspective_ && !(image.depth > 0)) {
    bounds.end[3] = 1;
    return;
  }
  // Relative to plane 0, so that nothing cancels if the eye is far away.
  const double k = Dot(Linear(camera_.depth_row), point - first_) / step_ - move_k_;
  at = {image.x - 0.5 - move_x_, image.y - 0.5 - move_y_, perspective_ ? numerator_ / image.depth : k};
  const double places[3] = {at.x, at.y, k};
  for (std::size_t i = 0; i < 3; ++i) {
    bounds.begin[i] = WholeFrom(places[i] - kSlack);
    bounds.end[i] = WholeFrom(places[i] + kSlack);
  }
}

void FrameSpace::Place(std::span<const Vector3<float>> points, FramePoints& result) const {
  result.points.resize(points.size());
  result.bounds.resize(points.size());
  ParallelForRanges(0, points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Place({double(points[i].x), double(points[i].y), double(points[i].z)}, result.points[i], result.bounds[i]);
    }
  });
}

RayReach FrameSpace::ReachOf(const Vec3& low, const Vec3& high) const {
  const Vec3 slack = {moved_, moved_, moved_};
  return ReachOfBox(rays_, camera_, low - slack, high + slack);
}

}  // namespace slabstream::slice
