#include "worker/render/splatting/cell_piece.h"

#include <cmath>

namespace slabstream {

BeamPiece CellPiece(const Homogeneous& first, const Homogeneous& step, const FootprintPair& footprint) {
  const double margin_x = 0.5 + footprint.x->radius, margin_y = 0.5 + footprint.y->radius;
  const double column = std::floor(first.x / first.w - margin_x), row = std::floor(first.y / first.w - margin_y);
  BeamPiece piece;
  piece.kernel_x = footprint.x;
  piece.kernel_y = footprint.y;
  piece.x0 = float(first.x - (column + margin_x) * first.w);
  piece.x_step = float(step.x - (column + margin_x) * step.w);
  piece.y0 = float(first.y - (row + margin_y) * first.w);
  piece.y_step = float(step.y - (row + margin_y) * step.w);
  piece.w0 = float(first.w);
  piece.w_step = float(step.w);
  piece.column = std::int32_t(column) + 1;
  piece.row = std::int32_t(row) + 1;
  return piece;
}

}  // namespace slabstream
