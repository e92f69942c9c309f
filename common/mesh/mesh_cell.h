// What is asked of one cell of a mesh: the space and the values that it covers. A mesh lies in data space of its lattice here.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/mesh/mesh.h"
#include "common/volume/box.h"
#include "common/volume/summary.h"

namespace slabstream {

// Closed: both sides belong to it.
struct CellBounds {
  Vector3<float> low, high;
};

inline bool Touch(const CellBounds& a, const CellBounds& b) {
  return a.low.x <= b.high.x && a.low.y <= b.high.y && a.low.z <= b.high.z && a.high.x >= b.low.x && a.high.y >= b.low.y &&
         a.high.z >= b.low.z;
}

inline CellBounds BoundsOf(const Mesh& mesh, std::size_t cell) {
  const Tetrahedron& t = mesh.tetrahedra[cell];
  const Vector3<float>&a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]], &d = mesh.points[t[3]];
  const auto least = [](float p, float q, float r, float s) { return std::min(std::min(p, q), std::min(r, s)); };
  const auto most = [](float p, float q, float r, float s) { return std::max(std::max(p, q), std::max(r, s)); };
  return {{least(a.x, b.x, c.x, d.x), least(a.y, b.y, c.y, d.y), least(a.z, b.z, c.z, d.z)},
          {most(a.x, b.x, c.x, d.x), most(a.y, b.y, c.y, d.y), most(a.z, b.z, c.z, d.z)}};
}

// What the voxels of a box fill.
inline CellBounds SpaceOf(const Box& box) {
  const auto side = [](const Index3& voxel) { return Vector3<float>{float(voxel.x) - 0.5F, float(voxel.y) - 0.5F, float(voxel.z) - 0.5F}; };
  return {side(box.begin), side(box.end)};
}

// The voxels of a lattice of `size` whose space, 0.5 to each side of their centres, these bounds touch.
inline Box VoxelsTouched(const CellBounds& bounds, const Index3& size) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    // Clamped as floating-point numbers: an int may be too small for where a point lies.
    box.begin[axis] = std::int32_t(std::clamp(std::ceil(double(bounds.low[axis]) - 0.5), 0.0, double(size[axis])));
    box.end[axis] = std::int32_t(std::clamp(std::floor(double(bounds.high[axis]) + 0.5) + 1, 0.0, double(size[axis])));
  }
  return box;
}

// The least and the greatest value in a cell; kNoFiniteValue if one of its values is not finite: then nothing of it is seen.
inline ValueRange ValuesIn(const Mesh& mesh, std::size_t cell) {
  if (mesh.at == ValuesAt::kCells) {
    const float value = mesh.values[cell];
    return std::isfinite(value) ? ValueRange{value, value} : kNoFiniteValue;
  }
  const Tetrahedron& t = mesh.tetrahedra[cell];
  const float a = mesh.values[t[0]], b = mesh.values[t[1]], c = mesh.values[t[2]], d = mesh.values[t[3]];
  if (!(std::isfinite(a) && std::isfinite(b) && std::isfinite(c) && std::isfinite(d))) return kNoFiniteValue;
  return {std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d))};
}

}  // namespace slabstream
