#include <bit>

#include "laboratory/measure/transform_loops.h"

namespace slabstream {
namespace {

float Product(const std::array<float, 4>& row, int x, int y, int z) {
  return row[0] * float(x) + row[1] * float(y) + row[2] * float(z) + row[3];
}

}  // namespace

void StoreProductScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  std::size_t i = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x, ++i) {
        for (std::size_t c = 0; c < 3; ++c) points.components[c][i] = Product(matrix[c], x, y, z);
      }
    }
  }
}

void StoreIncrementsScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  const std::size_t beam = std::size_t(size.x), slice = beam * std::size_t(size.y), volume = slice * std::size_t(size.z);
  for (std::size_t c = 0; c < 3; ++c) {
    float* p = points.components[c].data();
    p[0] = matrix[c][3];
    for (std::size_t i = 1; i < beam; ++i) p[i] = p[i - 1] + matrix[c][0];
    for (std::size_t i = beam; i < slice; ++i) p[i] = p[i - beam] + matrix[c][1];
    for (std::size_t i = slice; i < volume; ++i) p[i] = p[i - slice] + matrix[c][2];
  }
}

std::uint32_t FuseProductScalar(const TransformMatrix& matrix, const Index3& size) {
  std::uint32_t used = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        for (const auto& row : matrix) used ^= std::bit_cast<std::uint32_t>(Product(row, x, y, z));
      }
    }
  }
  return used;
}

std::uint32_t FuseIncrementsScalar(const TransformMatrix& matrix, const Index3& size) {
  std::uint32_t used = 0;
  std::array<float, 3> slice{}, beam{}, voxel{};
  for (std::size_t c = 0; c < 3; ++c) slice[c] = matrix[c][3];
  for (int z = 0; z < size.z; ++z) {
    beam = slice;
    for (int y = 0; y < size.y; ++y) {
      voxel = beam;
      for (int x = 0; x < size.x; ++x) {
        for (std::size_t c = 0; c < 3; ++c) {
          used ^= std::bit_cast<std::uint32_t>(voxel[c]);
          voxel[c] += matrix[c][0];
        }
      }
      for (std::size_t c = 0; c < 3; ++c) beam[c] += matrix[c][1];
    }
    for (std::size_t c = 0; c < 3; ++c) slice[c] += matrix[c][2];
  }
  return used;
}

}  // namespace slabstream
