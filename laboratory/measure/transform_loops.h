// The transform of all voxels of a slab, x fastest: as a matrix product for each voxel, and by running additions (the paper's seed, voxel,
// beam and slice phases). Stored: three arrays of coordinates. Fused: coordinates are used at once and never stored; here their bits are
// combined, which is about the least possible use of them.
//
// Scalar loops are compiled without automatic vectorisation; vector loops use Highway, for the best instruction set of the machine.
#pragma once

#include <array>
#include <cstdint>

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
void StoreIncrementsScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
std::uint32_t FuseProductScalar(const TransformMatrix& matrix, const Index3& size);
std::uint32_t FuseIncrementsScalar(const TransformMatrix& matrix, const Index3& size);

void StoreProductVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
void StoreIncrementsVector(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points);
std::uint32_t FuseProductVector(const TransformMatrix& matrix, const Index3& size);
std::uint32_t FuseIncrementsVector(const TransformMatrix& matrix, const Index3& size);

}  // namespace slabstream
