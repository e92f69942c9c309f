#include "worker/renderers/shear/shear_passes.h"

#include <cmath>

namespace slabstream::shear {

ShearPasses MakeShearPasses(const Vec3& start, const Vec3& right, const Vec3& down, const Vec3& forward) {
  ShearPasses passes;
  Axis z = Axis::kX;
  for (const Axis axis : kAxes) {
    if (std::abs(forward[axis]) > std::abs(forward[z])) z = axis;
  }
  // Movements in a slice: along a row or a column, then along the ray back to the slice.
  const auto in_slice = [&](const Vec3& movement, Axis axis) { return movement[axis] - forward[axis] / forward[z] * movement[z]; };
  double largest = -1;
  for (const bool turned : {false, true}) {
    for (const int first : {0, 1}) {
      const Axis x = kAxes[std::size_t(Number(z) + 1 + first) % 3], y = kAxes[std::size_t(Number(z) + 2 - first) % 3];
      const double pivot = std::abs(in_slice(turned ? right : down, y));
      if (pivot <= largest) continue;
      largest = pivot;
      passes.axes = {x, y, z};
      passes.turned = turned;
    }
  }
  const auto [x, y, unused] = passes.axes;
  const Vec3 &along_u = passes.turned ? down : right, &along_v = passes.turned ? right : down;
  passes.z_k = forward[z];
  passes.slide_x = forward[x] / forward[z];
  passes.slide_y = forward[y] / forward[z];

  passes.y_u = in_slice(along_u, y);
  passes.y_v = in_slice(along_v, y);
  passes.y_z = passes.slide_y;
  passes.y_0 = start[y] - passes.slide_y * start[z];

  // x in a slice, with v expressed by y.
  passes.x_y = in_slice(along_v, x) / passes.y_v;
  passes.x_u = in_slice(along_u, x) - passes.x_y * passes.y_u;
  passes.x_z = passes.slide_x - passes.x_y * passes.slide_y;
  passes.x_0 = start[x] - passes.slide_x * start[z] - passes.x_y * passes.y_0;
  return passes;
}

}  // namespace slabstream::shear
