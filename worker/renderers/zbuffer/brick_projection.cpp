#include "worker/renderers/zbuffer/brick_projection.h"

#include <algorithm>
#include <cmath>

#include "common/math/row4.h"

namespace slabstream {
namespace {

constexpr double kReach = 0.501;  // voxels from a face's centre to the edge of what it covers, a little more than kFaceReach

std::int32_t ToPixel(double x, std::int32_t limit) { return std::int32_t(std::clamp(std::ceil(x), 0.0, double(limit))); }

}  // namespace

BrickProjection::BrickProjection(const Camera& camera, const Index3& volume_size) : camera_(camera), volume_size_(volume_size) {
  const bool perspective = camera.projection == Projection::kPerspective;
  const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
  ray_x_ = (1.0 / camera.width) * (perspective ? right.direction - first.direction : right.origin - first.origin);
  ray_y_ = (1.0 / camera.height) * (perspective ? down.direction - first.direction : down.origin - first.origin);
  direction_ = camera.RayAt(0.5 * camera.width, 0.5 * camera.height).direction;
  for (int side = 0; side < kSides; ++side) {
    FaceProjection& faces = by_side_[std::size_t(side)];
    faces.a = side / 2;
    faces.u = faces.a == 0 ? 1 : 0;
    faces.v = faces.a == 2 ? 1 : 2;
    faces.sign = side % 2 == 0 ? -1 : 1;
    const auto u = std::size_t(faces.u), v = std::size_t(faces.v);
    for (std::size_t i = 0; i < 3; ++i) faces.depth_step[i] = float(camera.depth_row[i]);
    if (perspective) {
      faces.ray_x_a = float(ray_x_[faces.a]);
      faces.ray_x_u = float(ray_x_[faces.u]);
      faces.ray_x_v = float(ray_x_[faces.v]);
      faces.ray_y_a = float(ray_y_[faces.a]);
      faces.ray_y_u = float(ray_y_[faces.u]);
      faces.ray_y_v = float(ray_y_[faces.v]);
      continue;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      faces.x_step[i] = float(camera.x_row[i]);
      faces.y_step[i] = float(camera.y_row[i]);
    }
    faces.half_width = float(kReach * (std::abs(camera.x_row[u]) + std::abs(camera.x_row[v])));
    faces.half_height = float(kReach * (std::abs(camera.y_row[u]) + std::abs(camera.y_row[v])));
    // A pixel aside, the ray has moved by ray_x; along `direction` it meets the plane at another depth. Edge-on sides are never drawn.
    const double per_direction = direction_[faces.a] == 0 ? 0 : 1 / direction_[faces.a];
    const double depth_x = -ray_x_[faces.a] * per_direction, depth_y = -ray_y_[faces.a] * per_direction;
    faces.depth_x = float(depth_x);
    faces.depth_y = float(depth_y);
    faces.u_x = float(ray_x_[faces.u] + depth_x * direction_[faces.u]);
    faces.u_y = float(ray_y_[faces.u] + depth_y * direction_[faces.u]);
    faces.v_x = float(ray_x_[faces.v] + depth_x * direction_[faces.v]);
    faces.v_y = float(ray_y_[faces.v] + depth_y * direction_[faces.v]);
  }
}

// Half the size of the projection is at most sum_i half_i |x_i - x w_i|, divided by the least w of the box.
BrickProjection::Extent BrickProjection::Project(const Vec3& centre, const Vec3& half) const {
  const double w = Apply(camera_.w_row, centre), per_w = 1 / w;
  Extent extent{Apply(camera_.x_row, centre) * per_w, Apply(camera_.y_row, centre) * per_w, 0, 0, w};
  for (std::size_t i = 0; i < 3; ++i) {
    const double reach = half[int(i)];
    extent.half_x += reach * std::abs(camera_.x_row[i] - extent.x * camera_.w_row[i]);
    extent.half_y += reach * std::abs(camera_.y_row[i] - extent.y * camera_.w_row[i]);
    extent.least_w -= reach * std::abs(camera_.w_row[i]);
  }
  extent.half_x /= extent.least_w;
  extent.half_y /= extent.least_w;
  return extent;
}

ProjectedBrick BrickProjection::View(const SurfaceBrick& brick) const {
  const Vec3 begin = ToVec3(brick.voxels.begin), end = ToVec3(brick.voxels.end);
  const Vec3 centre = 0.5 * (begin + end - Vec3{1, 1, 1}), half = 0.5 * (end - begin);
  ProjectedBrick view;
  for (int axis = 0; axis < 3; ++axis) {
    if (camera_.projection == Projection::kPerspective) {
      if (camera_.eye[axis] < end[axis] - 1.5) view.sides |= 1U << (2 * axis);
      if (camera_.eye[axis] > begin[axis] + 0.5) view.sides |= 2U << (2 * axis);
    } else {
      if (direction_[axis] > 0) view.sides |= 1U << (2 * axis);
      if (direction_[axis] < 0) view.sides |= 2U << (2 * axis);
    }
  }
  const Extent extent = Project(centre, half);
  constexpr double kSlack = 1.002;  // for kReach, and for rounding
  const double half_x = kSlack * extent.half_x + 1e-3, half_y = kSlack * extent.half_y + 1e-3;
  view.pixels = {ToPixel(extent.x - half_x - 0.5, camera_.width), ToPixel(extent.y - half_y - 0.5, camera_.height),
                 ToPixel(extent.x + half_x + 0.5, camera_.width), ToPixel(extent.y + half_y + 0.5, camera_.height)};
  double nearest = Apply(camera_.depth_row, centre);
  for (std::size_t i = 0; i < 3; ++i) nearest -= kSlack * half[int(i)] * std::abs(camera_.depth_row[i]);
  view.nearest = std::max(0.0F, float(nearest * (1 - 1e-5)));
  return view;
}

FaceProjection BrickProjection::Faces(const SurfaceBrick& brick, int side) const {
  FaceProjection faces = by_side_[std::size_t(side)];
  Vec3 base = ToVec3(brick.origin);
  base[faces.a] += 0.5 * double(faces.sign);
  const double w = Apply(camera_.w_row, base);
  const double x = Apply(camera_.x_row, base) / w, y = Apply(camera_.y_row, base) / w;
  const double column = std::floor(x - 0.5), row = std::floor(y - 0.5);
  faces.column = std::int32_t(column);
  faces.row = std::int32_t(row);
  faces.x_phase = float(x - 0.5 - column);
  faces.y_phase = float(y - 0.5 - row);
  faces.depth = float(Apply(camera_.depth_row, base));
  if (camera_.projection == Projection::kOrthographic) return faces;

  for (std::size_t i = 0; i < 3; ++i) {
    faces.x_step[i] = float(camera_.x_row[i] - x * camera_.w_row[i]);
    faces.y_step[i] = float(camera_.y_row[i] - y * camera_.w_row[i]);
  }
  faces.eye_a = float(base[faces.a] - camera_.eye[faces.a]);
  faces.eye_u = float(base[faces.u] - camera_.eye[faces.u]);
  faces.eye_v = float(base[faces.v] - camera_.eye[faces.v]);
  // The largest face of the brick: the screen position farthest out, at the least depth.
  Vec3 end = base;
  for (int i = 0; i < 3; ++i) end[i] = std::min(brick.origin[i] + kFaceBrick, volume_size_[i]) - 0.5;
  const Vec3 begin = ToVec3(brick.origin) - Vec3{0.5, 0.5, 0.5};
  const Extent extent = Project(0.5 * (begin + end), 0.5 * (end - begin));
  for (int i : {faces.u, faces.v}) {
    const auto at = std::size_t(i);
    faces.half_width +=
        float(kReach * (std::abs(camera_.x_row[at] - extent.x * camera_.w_row[at]) + extent.half_x * std::abs(camera_.w_row[at])) /
              extent.least_w);
    faces.half_height +=
        float(kReach * (std::abs(camera_.y_row[at] - extent.y * camera_.w_row[at]) + extent.half_y * std::abs(camera_.w_row[at])) /
              extent.least_w);
  }
  return faces;
}

}  // namespace slabstream
