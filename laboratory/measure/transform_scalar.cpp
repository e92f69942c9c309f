#include "laboratory/measure/transform_loops.h"

namespace slabstream {

void StoreProductScalar(const TransformMatrix& matrix, const Index3& size, TransformedPoints& points) {
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

}  // namespace slabstream
