// A mesh of tetrahedra with one value at each point, between which it is linear, or one in each tetrahedron. What every reader of
// unstructured grids makes (data/volume_io), and all that is drawn of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/math/vec.h"
#include "common/memory/aligned_buffer.h"
#include "common/mesh/cells.h"

namespace slabstream {

inline constexpr std::int64_t kMaxMeshPoints = std::int64_t{1} << 31, kMaxTetrahedra = std::int64_t{1} << 31;

// To which elements of a grid an array belongs.
enum class ValuesAt : std::uint8_t { kPoints, kCells };
constexpr std::string_view NameOf(ValuesAt at) { return at == ValuesAt::kPoints ? "points" : "cells"; }

// Immutable once shared between threads.
struct Mesh {
  AlignedVector<Vector3<float>> points;  // finite; in data space of the lattice under the grid (lattice.h), unless it says otherwise
  std::vector<Tetrahedron> tetrahedra;   // indices of `points`; none has a point twice
  ValuesAt at = ValuesAt::kPoints;
  AlignedVector<float> values;  // by point or by tetrahedron; may not be finite: nothing is seen there
  // By point, for light (PointGradients); what a MeshCutter cuts out has them. Empty: not known.
  AlignedVector<Vector3<float>> gradients = {};

  std::size_t bytes() const {
    return (points.capacity() + gradients.capacity()) * sizeof(points[0]) + tetrahedra.capacity() * sizeof(Tetrahedron) +
           values.capacity() * sizeof(float);
  }
};

}  // namespace slabstream
