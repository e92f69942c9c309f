#include "worker/render/splatting/ownership.h"

#include <algorithm>
#include <cmath>

namespace slabstream {
namespace {

constexpr std::int32_t kFar = 1 << 30;

// Planes are moved down by this many voxels. A ray that runs within a plane (axis-parallel views have such rays through pixel centres)
// would else be given to one side in one slice and to the other in the next, as rounding has it, and its samples would be combined out of
// order.
constexpr double kPlaneShift = 0x1p-20;

Vec3 CrossProduct(const Homogeneous& a, const Homogeneous& b) { return Cross({a.x, a.y, a.w}, {b.x, b.y, b.w}); }

}  // namespace

Ownership::Ownership(const SliceProjection& projection, const Box& box, const VolumeGeometry& geometry) : projection_(projection) {
  for (Axis axis : {projection.axes().u, projection.axes().v}) {
    if (box.begin[axis] > 0) planes_.push_back({axis, box.begin[axis], true});
    if (box.end[axis] < geometry.size[axis]) planes_.push_back({axis, box.end[axis], false});
  }
}

// With the columns U, V, O of the matrix that takes (u, v, 1) to homogeneous image coordinates, the ray of P = (x, y, 1) meets the slice at
//   u = (V x O).P / (U x V).P,   v = (O x U).P / (U x V).P
// and (U x V).P has the sign of det(U, V, O) wherever the slice lies before the eye.
void Ownership::SetSlice(std::int32_t k) {
  const Homogeneous &u = projection_.step_u(), &v = projection_.step_v();
  const Homogeneous origin = projection_.SliceOrigin(k);
  const double sign = Determinant(u, v, origin) < 0 ? -1 : 1;
  const Vec3 denominator = CrossProduct(u, v);
  for (Plane& plane : planes_) {
    const Vec3 numerator = plane.axis == projection_.axes().u ? CrossProduct(v, origin) : CrossProduct(origin, u);
    const Vec3 line = sign * (numerator - (plane.position - 0.5 - kPlaneShift) * denominator);
    plane.by_x = line.x;
    plane.by_y = line.y;
    plane.constant = line.z;
  }
}

ColumnInterval Ownership::Row(std::int32_t row) const {
  ColumnInterval owned = {-kFar, kFar};
  for (const Plane& plane : planes_) {
    const double rest = plane.by_y * (row + 0.5) + plane.constant;
    ColumnInterval upper = {-kFar, kFar}, lower = {kFar, kFar};
    if (plane.by_x == 0) {
      if (rest < 0) std::swap(upper, lower);
    } else {
      // The first column whose centre lies at or beyond the crossing.
      const double crossing = std::clamp(std::ceil(-rest / plane.by_x - 0.5), double(-kFar), double(kFar));
      const auto column = std::int32_t(crossing);
      upper = {column, kFar};
      lower = {-kFar, column};
      if (plane.by_x < 0) std::swap(upper, lower);
    }
    const ColumnInterval& side = plane.own_upper ? upper : lower;
    owned = {std::max(owned.begin, side.begin), std::min(owned.end, side.end)};
  }
  return owned.begin < owned.end ? owned : ColumnInterval{0, 0};
}

bool Ownership::MayOwn(const PixelBounds& pixels) const {
  for (const Plane& plane : planes_) {
    const double sign = plane.own_upper ? 1 : -1;
    const double x = sign * plane.by_x > 0 ? pixels.x_end : pixels.x_begin, y = sign * plane.by_y > 0 ? pixels.y_end : pixels.y_begin;
    if (sign * (plane.by_x * x + plane.by_y * y + plane.constant) < 0) return false;
  }
  return true;
}

}  // namespace slabstream
