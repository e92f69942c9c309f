#include "worker/kernels/transform.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/transform.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;

template <class V>
HWY_INLINE void StoreTap(V t, std::int32_t origin, int phases, std::int32_t* HWY_RESTRICT first, std::int32_t* HWY_RESTRICT phase) {
  const FloatTag df;
  const IntTag di;
  const auto whole = hn::Floor(t);
  hn::StoreU(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, origin)), di, first);
  // t - whole is in [0, 1], and 1 where a tiny negative t rounds up.
  const auto part = hn::ConvertTo(di, hn::Mul(hn::Sub(t, whole), hn::Set(df, float(phases))));
  hn::StoreU(hn::Min(part, hn::Set(di, phases - 1)), di, phase);
}

// Not MulAdd: see the header.
template <bool kPerspective>
HWY_INLINE void Transform(VoxelBatch& batch) {
  const FloatTag df;
  const std::size_t lanes = hn::Lanes(df);
  std::size_t n = 0;
  for (const BeamPiece& piece : batch.pieces) {
    const int phases_x = piece.kernel_x->phases, phases_y = piece.kernel_y->phases;
    std::copy_n(piece.records, piece.count, &batch.record[n]);
    std::uint64_t mask = piece.mask;
    while (mask != 0) {
      const int begin = std::countr_zero(mask);
      const int count = std::countr_one(mask >> begin);
      for (std::size_t j = 0; j < std::size_t(count); j += lanes) {  // writes up to a vector too far; what follows overwrites it
        const std::size_t at = n + j;
        const auto i = hn::Iota(df, float(begin + int(j)));
        auto x = hn::Add(hn::Set(df, piece.x0), hn::Mul(i, hn::Set(df, piece.x_step)));
        auto y = hn::Add(hn::Set(df, piece.y0), hn::Mul(i, hn::Set(df, piece.y_step)));
        if constexpr (kPerspective) {
          const auto w = hn::Add(hn::Set(df, piece.w0), hn::Mul(i, hn::Set(df, piece.w_step)));
          const auto per_w = hn::Div(hn::Set(df, 1.0F), w);
          x = hn::Mul(x, per_w);
          y = hn::Mul(y, per_w);
          hn::StoreU(hn::Mul(hn::Mul(hn::Set(df, piece.area), per_w), hn::Mul(per_w, per_w)), df, &batch.area[at]);
        }
        StoreTap(x, piece.column, phases_x, &batch.column[at], &batch.phase_x[at]);
        StoreTap(y, piece.row, phases_y, &batch.row[at], &batch.phase_y[at]);
      }
      n += std::size_t(count);
      mask &= ~(((std::uint64_t{1} << count) - 1) << begin);
    }
  }
}

void TransformOrthographic(VoxelBatch& batch) { Transform<false>(batch); }
void TransformPerspective(VoxelBatch& batch) { Transform<true>(batch); }

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(TransformOrthographic);
HWY_EXPORT(TransformPerspective);

void TransformPieces(Projection projection, VoxelBatch& batch) {
  if (projection == Projection::kPerspective) {
    HWY_DYNAMIC_DISPATCH(TransformPerspective)(batch);
  } else {
    HWY_DYNAMIC_DISPATCH(TransformOrthographic)(batch);
  }
}

}  // namespace slabstream
#endif
