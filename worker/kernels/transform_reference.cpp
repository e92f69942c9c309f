#include <algorithm>
#include <bit>
#include <cmath>

#include "worker/kernels/transform.h"

namespace slabstream {
namespace {

struct Tap {
  std::int32_t first, phase;
};

Tap TapOf(float t, std::int32_t origin, int phases) {
  const float whole = std::floor(t);
  return {origin + std::int32_t(whole), std::min(std::int32_t((t - whole) * float(phases)), phases - 1)};
}

}  // namespace

void TransformPiecesReference(Projection projection, VoxelBatch& batch) {
  std::size_t n = 0;
  for (const BeamPiece& piece : batch.pieces) {
    std::copy_n(piece.records, piece.count, &batch.record[n]);
    for (std::uint32_t mask = piece.mask; mask != 0; mask &= mask - 1, ++n) {
      const auto i = float(std::countr_zero(mask));
      float x = piece.x0 + i * piece.x_step, y = piece.y0 + i * piece.y_step;
      if (projection == Projection::kPerspective) {
        const float per_w = 1 / (piece.w0 + i * piece.w_step);
        x *= per_w;
        y *= per_w;
        batch.area[n] = piece.area * per_w * (per_w * per_w);
      }
      const Tap in_x = TapOf(x, piece.column, piece.kernel_x->phases), in_y = TapOf(y, piece.row, piece.kernel_y->phases);
      batch.column[n] = in_x.first;
      batch.phase_x[n] = in_x.phase;
      batch.row[n] = in_y.first;
      batch.phase_y[n] = in_y.phase;
    }
  }
}

}  // namespace slabstream
