// PixelRays: the ray of every pixel, and where it meets the cell of a voxel (q - 0.5 to q + 0.5 along each axis). Everything here is a
// function of pixel and voxel alone, in double precision, in one order of operations: the same bits in every worker.
#pragma once

#include <algorithm>
#include <limits>

#include "common/view/camera.h"

namespace slabstream {

struct RaySpan {
  double enter, exit;  // camera depth; exit < enter: the ray misses the cell
};

class PixelRays {
 public:
  explicit PixelRays(const Camera& camera) {
    const Camera::Ray first = camera.RayAt(0, 0), right = camera.RayAt(camera.width, 0), down = camera.RayAt(0, camera.height);
    origin_ = first.origin;
    origin_x_ = (1.0 / camera.width) * (right.origin - first.origin);
    origin_y_ = (1.0 / camera.height) * (down.origin - first.origin);
    direction_ = first.direction;
    direction_x_ = (1.0 / camera.width) * (right.direction - first.direction);
    direction_y_ = (1.0 / camera.height) * (down.direction - first.direction);
  }

  struct Ray {
    Vec3 origin, direction;  // data space; depth grows by 1 along `direction`
    Vec3 inverse;            // 1 / direction, by component
  };

  // Of the centre of a pixel of the frame.
  Ray At(std::int32_t column, std::int32_t row) const {
    const double x = column + 0.5, y = row + 0.5;
    const Vec3 direction = direction_ + x * direction_x_ + y * direction_y_;
    return {origin_ + x * origin_x_ + y * origin_y_, direction, Vec3{1, 1, 1} / direction};
  }

  // The slabs test. Neighbouring cells compute their common face alike, so no ray passes between them.
  static RaySpan Meet(const Ray& ray, const Vec3& cell_centre) {
    RaySpan span = {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
      const double low = cell_centre[axis] - 0.5 - ray.origin[axis], high = cell_centre[axis] + 0.5 - ray.origin[axis];
      if (ray.direction[axis] == 0) {  // parallel to these two faces
        if (low > 0 || high < 0) return {0, -1};
        continue;
      }
      const double a = low * ray.inverse[axis], b = high * ray.inverse[axis];
      span = {std::max(span.enter, std::min(a, b)), std::min(span.exit, std::max(a, b))};
    }
    return span;
  }

 private:
  Vec3 origin_, origin_x_, origin_y_, direction_, direction_x_, direction_y_;
};

}  // namespace slabstream
