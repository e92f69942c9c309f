#include "laboratory/measure/splat_loops.h"

namespace slabstream {

void DenseSlice::AddEachVoxel() {
  const std::int32_t k = footprint_.taps;
  const std::size_t sheet_row = 4 * std::size_t(pixels_);
  for (std::int32_t v = 0; v < side_; ++v) {
    for (std::int32_t u = 0; u < side_; ++u) {
      const float* rgba = &voxels_[VoxelAt(u, v)];
      if (rgba[3] == 0) continue;
      float* out = &sheet_[SheetAt(u, v)];
      const float* weight = square_.data();
      for (std::int32_t j = 0; j < k; ++j, out += sheet_row) {
        for (std::int32_t i = 0; i < k; ++i, ++weight) {
          for (std::int32_t c = 0; c < 4; ++c) out[4 * i + c] += *weight * rgba[c];
        }
      }
    }
  }
}

}  // namespace slabstream
