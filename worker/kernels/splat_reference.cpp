#include <algorithm>

#include "worker/kernels/splat.h"

namespace slabstream {
namespace {

// Weights of the taps begin ... end - 1 of a phase.
void TapWeights(const GaussianKernel& kernel, std::int32_t phase, std::int32_t begin, std::int32_t end, std::vector<float>& weights) {
  weights.clear();
  for (std::int32_t tap = begin; tap < end; ++tap) {
    weights.push_back(kernel.has_tables() ? kernel.y_weights[std::size_t(phase) * std::size_t(kernel.taps) + std::size_t(tap)]
                                          : TapWeight(kernel, phase, tap));
  }
}

}  // namespace

void SplatPieceReference(const VoxelBatch& batch, const BeamPiece& piece, std::size_t first, const SheetView& sheet) {
  std::vector<float> wx, wy;
  for (std::size_t n = first; n < first + std::size_t(piece.count); ++n) {
    const std::int32_t column = batch.column[n], row = batch.row[n];
    const std::int32_t left = std::max(0, -column), right = std::min(piece.kernel_x->taps, sheet.width - column);
    const std::int32_t top = std::max(0, -row), bottom = std::min(piece.kernel_y->taps, sheet.height - row);
    if (left >= right || top >= bottom) continue;
    TapWeights(*piece.kernel_x, batch.phase_x[n], left, right, wx);
    TapWeights(*piece.kernel_y, batch.phase_y[n], top, bottom, wy);
    for (std::size_t j = 0; j < wy.size(); ++j) {
      float* pixel = sheet.rgba + 4 * ((std::size_t(row + top) + j) * std::size_t(sheet.width) + std::size_t(column + left));
      for (std::size_t i = 0; i < wx.size(); ++i, pixel += 4) {
        for (std::size_t c = 0; c < 4; ++c) pixel[c] += wy[j] * (wx[i] * batch.rgba[4 * n + c]);
      }
    }
  }
}

void SplatPiecesReference(const VoxelBatch& batch, const SheetView& sheet) {
  std::size_t first = 0;
  for (const BeamPiece& piece : batch.pieces) {
    SplatPieceReference(batch, piece, first, sheet);
    first += std::size_t(piece.count);
  }
}

}  // namespace slabstream
