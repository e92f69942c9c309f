// Two ways to transform all voxels of a slab, x fastest, into three arrays of coordinates: a matrix product for each voxel, and running
// additions. They run along a beam in vectors, from beam to beam and slice to slice one coordinate after the other; the paper's phases add
// whole beams and slices.
//
// The scalar loop is compiled without automatic vectorisation; vector loops use Highway, for the best instruction set of the machine.
#pragma once

#include <array>

#include "common/base/aligned_buffer.h"
#include "common/volume/box.h"

namespace slabstream {

using TransformMatrix = std::array<std::array<float, 4>, 3>;  // rows of x, y and depth

struct TransformedPoints {
  explicit TransformedPoints(const Index3& size) {
    for (auto& component : components) component.resize(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z) + 64);
  }
  std::array<AlignedVector<float>, 3> components;
};

void StoreProductScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void StoreProductVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void StoreIncrementsVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);

}  // namespace slabstream
