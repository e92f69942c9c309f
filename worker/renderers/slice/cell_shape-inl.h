// MakeCellShape. Included once for each instruction set, hence the unusual include guard. Multiplications and additions are not fused.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "worker/renderers/slice/cell_shape.h"
#include "worker/renderers/slice/frame_space.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SLICE_CELL_SHAPE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SLICE_CELL_SHAPE_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SLICE_CELL_SHAPE_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SLICE_CELL_SHAPE_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::slice::HWY_NAMESPACE {

// What a cell has at its points, in ascending order of their numbers.
struct CellCorners {
  std::array<const FramePoint*, 4> points;
  std::array<float, 4> values;                     // finite
  std::array<const Vector3<float>*, 4> gradients;  // null: the cell is not lit
  bool scaled_value, scaled_gradient;              // linear in data space under perspective: multiplied by s, so linear in frame space
};

// x is counted from `x_begin`. False: the cell is so flat that no sample lies in it; `shape` is undefined then.
HWY_INLINE bool MakeCellShape(const CellCorners& corners, double x_begin, CellShape& shape) {
  const auto& points = corners.points;
  const auto& values = corners.values;
  constexpr double kFlat = 1e-7;  // height over a face, in pixels and planes
  constexpr double kInfinity = 1e300;
  const auto from = [&](std::size_t a, std::size_t b) {
    return Vec3{points[b]->x - points[a]->x, points[b]->y - points[a]->y, points[b]->s - points[a]->s};
  };
  const Vec3 p01 = from(0, 1), p02 = from(0, 2), p03 = from(0, 3);
  // The normal of the face that lacks each point.
  std::array<Vec3, 4> normals = {Cross(from(1, 2), from(1, 3)), Cross(p02, p03), Cross(p01, p03), Cross(p01, p02)};
  // Six times; on point i, the function of the face that lacks it has the value of this with alternating signs, - + - +.
  const double volume = Dot(normals[3], p03);
  double largest = 0;
  for (const Vec3& n : normals) largest = std::max(largest, Dot(n, n));
  if (!(volume * volume > kFlat * kFlat * largest)) return false;

  // Faces before the cell come first.
  std::size_t next_before = 0, next_behind = 3;
  for (std::size_t face = 0; face < 4; ++face) {
    Vec3& n = normals[face];
    if (n.x == 0) n.x = 1e-100;  // parallel to rows: the face is as far away as if it were turned a little
    const FramePoint& p = *points[face == 0 ? 1 : 0];
    const double per_x = -1 / n.x, per_y = n.y * per_x, per_s = n.z * per_x;
    const bool before = ((volume > 0) == (face % 2 == 1)) == (n.x > 0);
    const std::size_t place = before ? next_before : next_behind;
    next_before += before ? 1 : 0;
    next_behind -= before ? 0 : 1;
    shape.at[place] = ((p.x - x_begin) - per_y * p.y) - per_s * p.s;
    shape.per_s[place] = per_s;
    shape.per_y[place] = per_y;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const bool before = i + 1 < next_before;
    shape.before[i] = before ? 0 : -kInfinity;
    shape.behind[i] = before ? kInfinity : 0;
  }

  const double part = 1 / volume;
  const auto through = [&](double v0, double v1, double v2, double v3) -> LinearFunction {
    const double a = (v1 - v0) * part, b = (v0 - v2) * part, c = (v3 - v0) * part;
    const Vec3 g = a * normals[1] + b * normals[2] + c * normals[3];
    return {v0 - g.x * (points[0]->x - x_begin) - g.y * points[0]->y - g.z * points[0]->s, g.z, g.y, g.x};
  };
  const auto of_points = [&](bool scaled, auto&& value) {
    const auto at = [&](std::size_t i) { return double(value(i)) * (scaled ? points[i]->s : 1); };
    return through(at(0), at(1), at(2), at(3));
  };
  shape.value = of_points(corners.scaled_value, [&](std::size_t i) { return values[i]; });
  for (int axis = 0; corners.gradients[0] != nullptr && axis < 3; ++axis) {
    shape.slope[axis] = of_points(corners.scaled_gradient, [&](std::size_t i) { return (*corners.gradients[i])[axis]; });
  }
  shape.least = std::min(std::min(values[0], values[1]), std::min(values[2], values[3]));
  shape.greatest = std::max(std::max(values[0], values[1]), std::max(values[2], values[3]));
  return true;
}

}  // namespace slabstream::slice::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
