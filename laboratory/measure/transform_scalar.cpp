#include "laboratory/measure/transform_loops.h"

namespace slabstream {
namespace {

// values[i] = values[i - length] + step, for `vectors` vectors of this length; the first one is there.
void AddVectors(float* values, std::size_t vectors, std::size_t length, float step) {
  for (std::size_t i = length; i < vectors * length; ++i) values[i] = values[i - length] + step;
}

}  // namespace

void ProductScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  std::size_t i = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x, ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
          const std::array<float, 4>& row = matrix[c];
          points.components[c][i] = row[0] * float(x) + row[1] * float(y) + row[2] * float(z) + row[3];
        }
      }
    }
  }
}

void SeedPhase(const TransformMatrix& matrix, const Index3& /*size*/, TransformedPoints& points) {
  ProductScalar(matrix, {1, 1, 1}, points);
}

void VoxelPhase(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  for (std::size_t c = 0; c < 3; ++c) AddVectors(points.components[c].data(), std::size_t(size.x), 1, matrix[c][0]);
}

void BeamPhaseScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  for (std::size_t c = 0; c < 3; ++c) AddVectors(points.components[c].data(), std::size_t(size.y), std::size_t(size.x), matrix[c][1]);
}

void SlicePhaseScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
  const std::size_t slice = std::size_t(size.x) * std::size_t(size.y);
  for (std::size_t c = 0; c < 3; ++c) AddVectors(points.components[c].data(), std::size_t(size.z), slice, matrix[c][2]);
}

}  // namespace slabstream
