// The transform of all voxels of a cube, x fastest: as a matrix product a voxel, and by running additions (the paper's seed, voxel, beam
// and slice phases). Stored: three arrays of coordinates. Fused: coordinates are used at once and never stored; here their bits are
// combined, which is about the least that one can do with them.
//
// Scalar loops are compiled without automatic vectorisation; vector loops use Highway, for the best instruction set of the machine.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/aligned_buffer.h"

namespace slabstream::bench {

using Matrix = std::array<std::array<float, 4>, 3>;  // rows of x, y and depth

struct Points {
  explicit Points(int side) {
    for (auto& component : components) component.resize(std::size_t(side) * std::size_t(side) * std::size_t(side) + 64);
  }
  std::array<AlignedVector<float>, 3> components;
};

void StoreProductScalar(const Matrix& matrix, int side, Points& points);
void StoreIncrementsScalar(const Matrix& matrix, int side, Points& points);
std::uint32_t FuseProductScalar(const Matrix& matrix, int side);
std::uint32_t FuseIncrementsScalar(const Matrix& matrix, int side);

void StoreProductVector(const Matrix& matrix, int side, Points& points);
void StoreIncrementsVector(const Matrix& matrix, int side, Points& points);
std::uint32_t FuseProductVector(const Matrix& matrix, int side);
std::uint32_t FuseIncrementsVector(const Matrix& matrix, int side);

}  // namespace slabstream::bench
