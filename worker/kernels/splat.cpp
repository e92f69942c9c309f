#include "worker/kernels/splat.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/splat.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most 32 bytes: two pixels. Wider registers make the stores of neighbouring voxels overlap more, which costs more than they save.
using PixelTag = hn::CappedTag<float, 8>;

// RGBA of a voxel, repeated over the register; where there are no vectors, the channel of register k.
HWY_INLINE hn::Vec<PixelTag> Value(const float* rgba, std::size_t k) {
  if constexpr (hn::MaxLanes(PixelTag()) >= 4) return hn::LoadDup128(PixelTag(), rgba);
  return hn::LoadU(PixelTag(), rgba + k % 4);
}

// Columns of a footprint, `kVectors` registers wide, inside the sheet. `wx` points at the x weights of these registers.
template <std::size_t kVectors>
HWY_INLINE void SplatColumns(const float* HWY_RESTRICT wx, const float* HWY_RESTRICT wy, std::int32_t rows, const float* HWY_RESTRICT rgba,
                             float* pixels, std::size_t row_floats) {
  const PixelTag d;
  constexpr std::size_t kLanes = hn::MaxLanes(PixelTag());
  hn::Vec<PixelTag> row_values[kVectors];
  for (std::size_t k = 0; k < kVectors; ++k) row_values[k] = hn::Mul(hn::LoadU(d, wx + k * kLanes), Value(rgba, k));
  for (std::int32_t j = 0; j < rows; ++j, pixels += row_floats) {
    const auto weight = hn::Set(d, wy[j]);
    for (std::size_t k = 0; k < kVectors; ++k) {
      float* at = pixels + k * kLanes;
      hn::StoreU(hn::MulAdd(weight, row_values[k], hn::LoadU(d, at)), d, at);
    }
  }
}

// `taps` columns, a multiple of kTapPadding. Footprints wider than four registers go column block by column block.
HWY_INLINE void SplatPairs(const float* HWY_RESTRICT wx, const float* HWY_RESTRICT wy, std::int32_t taps, std::int32_t rows,
                           const float* HWY_RESTRICT rgba, float* pixels, std::size_t row_floats) {
  constexpr std::size_t kLanes = hn::MaxLanes(PixelTag());
  std::size_t vectors = std::size_t(taps) * 4 / kLanes;
  for (; vectors > 4; vectors -= 4, wx += 4 * kLanes, pixels += 4 * kLanes) SplatColumns<4>(wx, wy, rows, rgba, pixels, row_floats);
  switch (vectors) {
    case 1: SplatColumns<1>(wx, wy, rows, rgba, pixels, row_floats); break;
    case 2: SplatColumns<2>(wx, wy, rows, rgba, pixels, row_floats); break;
    case 3: SplatColumns<3>(wx, wy, rows, rgba, pixels, row_floats); break;
    case 4: SplatColumns<4>(wx, wy, rows, rgba, pixels, row_floats); break;
    default: break;
  }
}

// The last pixel column of a footprint that the sheet's border cuts to an odd number.
HWY_INLINE void SplatPixelColumn(const float* wx, const float* wy, std::int32_t rows, const float* rgba, float* pixel,
                                 std::size_t row_floats) {
  for (std::int32_t j = 0; j < rows; ++j, pixel += row_floats) {
    for (int c = 0; c < 4; ++c) pixel[c] += wy[j] * (wx[c] * rgba[c]);
  }
}

void SplatAll(const VoxelBatch& batch, const SheetView& view) {
  // Everything that the loop reads is local: the compiler cannot know that stores to the sheet leave it alone.
  const SheetView sheet = view;
  const std::size_t row_floats = 4 * std::size_t(sheet.width);
  const std::int32_t* HWY_RESTRICT columns = batch.column.data();
  const std::int32_t* HWY_RESTRICT rows = batch.row.data();
  const std::int32_t* HWY_RESTRICT phases_x = batch.phase_x.data();
  const std::int32_t* HWY_RESTRICT phases_y = batch.phase_y.data();
  const float* HWY_RESTRICT rgba = batch.rgba.data();
  const BeamPiece* const pieces_end = batch.pieces.data() + batch.pieces.size();
  std::size_t n = 0;
  for (const BeamPiece* piece = batch.pieces.data(); piece != pieces_end; ++piece) {
    if (!piece->kernel_x->has_tables() || !piece->kernel_y->has_tables()) {
      SplatPieceReference(batch, *piece, n, sheet);
      n += std::size_t(piece->count);
      continue;
    }
    const float* HWY_RESTRICT x_weights = piece->kernel_x->x_weights.data();
    const float* HWY_RESTRICT y_weights = piece->kernel_y->y_weights.data();
    const std::int32_t* HWY_RESTRICT x_taps = piece->kernel_x->phase_columns.data();
    const std::int32_t* HWY_RESTRICT y_taps = piece->kernel_y->phase_rows.data();
    const std::size_t x_stride = 4 * std::size_t(piece->kernel_x->padded_taps), y_stride = std::size_t(piece->kernel_y->taps);
    for (const std::size_t end = n + std::size_t(piece->count); n < end; ++n) {
      const auto phase_x = std::size_t(phases_x[n]), phase_y = std::size_t(phases_y[n]);
      const std::int32_t column = columns[n], row = rows[n];
      const float* wx = x_weights + phase_x * x_stride;
      const float* wy = y_weights + phase_y * y_stride;
      const std::int32_t taps_x = x_taps[phase_x], taps_y = y_taps[phase_y];
      if (column >= 0 && row >= 0 && column + taps_x <= sheet.width && row + taps_y <= sheet.height) {
        SplatPairs(wx, wy, taps_x, taps_y, rgba + 4 * n, sheet.rgba + std::size_t(row) * row_floats + 4 * std::size_t(column), row_floats);
        continue;
      }
      // The part of the footprint that lies on the sheet, in taps.
      const std::int32_t left = std::max(0, -column), right = std::min(taps_x, sheet.width - column);
      const std::int32_t top = std::max(0, -row), bottom = std::min(taps_y, sheet.height - row);
      if (left >= right || top >= bottom) continue;
      float* pixels = sheet.rgba + std::size_t(row + top) * row_floats + 4 * std::size_t(column + left);
      const std::int32_t pairs = (right - left) / kTapPadding * kTapPadding;
      wx += 4 * left;
      wy += top;
      SplatPairs(wx, wy, pairs, bottom - top, rgba + 4 * n, pixels, row_floats);
      if (pairs < right - left) SplatPixelColumn(wx + 4 * pairs, wy, bottom - top, rgba + 4 * n, pixels + 4 * pairs, row_floats);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(SplatAll);

void SplatPieces(const VoxelBatch& batch, const SheetView& sheet) { HWY_DYNAMIC_DISPATCH(SplatAll)(batch, sheet); }

}  // namespace slabstream
#endif
