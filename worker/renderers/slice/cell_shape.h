// CellShape: a tetrahedron in frame space, as functions that are linear there. On a row of a plane it is the interval between faces.
//
// A face lies at x = at + s * per_s + y * per_y. The two cells that share it compute the same bits, since they take its points in the same
// order. One cell has the whole numbers x >= root, the other one those below: so every sample inside a grid lies in one cell.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "worker/renderers/slice/frame_space.h"

namespace slabstream::slice {

struct CellShape {
  // Faces. Face 0 lies before the cell (x >= root), face 3 behind it, and the others as the numbers say that are added to their roots: 0 or
  // an infinity.
  double at[4], per_s[4], per_y[4];
  double before[2], behind[2];  // of faces 1 and 2
  // The value, times 1 / FrameSpace::ScaleOf(k): value + s * value_s + y * value_y + x * value_x.
  double value, value_s, value_y, value_x;
  float least, greatest;  // of the cell's values
};

// `points` and `values` (finite) are in ascending order of the points' numbers. x is counted from `x_begin`. `scaled`: values are
// multiplied by s. False: the cell is so flat that no sample lies in it; `shape` is undefined then.
inline bool MakeCellShape(const std::array<FramePoint, 4>& points, const std::array<float, 4>& values, double x_begin, bool scaled,
                          CellShape& shape) {
  constexpr double kFlat = 1e-7;  // height over a face, in pixels and planes
  constexpr double kInfinity = 1e300;
  const auto from = [&](std::size_t a, std::size_t b) {
    return Vec3{points[b].x - points[a].x, points[b].y - points[a].y, points[b].s - points[a].s};
  };
  const Vec3 p01 = from(0, 1), p02 = from(0, 2), p03 = from(0, 3);
  // Of the face that lacks each point.
  const std::array<Vec3, 4> normals = {Cross(from(1, 2), from(1, 3)), Cross(p02, p03), Cross(p01, p03), Cross(p01, p02)};
  const double volume = Dot(normals[3], p03);  // six times; each point's function has the value -+ volume there
  double largest = 0;
  for (const Vec3& n : normals) largest = std::max(largest, Dot(n, n));
  if (!(volume * volume > kFlat * kFlat * largest)) return false;

  std::size_t next_before = 0, next_behind = 3;
  for (std::size_t face = 0; face < 4; ++face) {
    Vec3 n = normals[face];
    if (n.x == 0) n.x = 1e-100;  // parallel to rows: the face is far away on the side that it would be on if it were turned a little
    const FramePoint& p = points[face == 0 ? 1 : 0];
    const bool inside_is_positive = (volume > 0) == (face % 2 == 1);
    const std::size_t place = inside_is_positive == (n.x > 0) ? next_before++ : next_behind--;
    const double per_x = -1 / n.x;
    shape.per_y[place] = n.y * per_x;
    shape.per_s[place] = n.z * per_x;
    shape.at[place] = ((p.x - x_begin) - shape.per_y[place] * p.y) - shape.per_s[place] * p.s;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const bool before = i + 1 < next_before;
    shape.before[i] = before ? 0 : -kInfinity;
    shape.behind[i] = before ? kInfinity : 0;
  }

  std::array<double, 4> v{};
  for (std::size_t i = 0; i < 4; ++i) v[i] = double(values[i]) * (scaled ? points[i].s : 1);
  const Vec3 gradient = (1 / volume) * ((v[1] - v[0]) * normals[1] - (v[2] - v[0]) * normals[2] + (v[3] - v[0]) * normals[3]);
  shape.value_x = gradient.x;
  shape.value_y = gradient.y;
  shape.value_s = gradient.z;
  shape.value = v[0] - gradient.x * (points[0].x - x_begin) - gradient.y * points[0].y - gradient.z * points[0].s;
  shape.least = *std::ranges::min_element(values);
  shape.greatest = *std::ranges::max_element(values);
  return true;
}

}  // namespace slabstream::slice
