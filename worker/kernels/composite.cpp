#include "worker/kernels/composite.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/composite.cpp"
#include <hwy/foreach_target.h>
// Highway wants this order.
#include <hwy/highway.h>

#include <hwy/contrib/math/math-inl.h>

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RowTag = hn::CappedTag<float, kTile>;

template <bool kPerspective>
HWY_INLINE float Composite(const TileWork& tile) {
  const RowTag d;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  auto least = one;
  for (int j = 0; j < kTile; ++j) {
    for (int i = 0; i < kTile; i += int(hn::Lanes(d))) {
      const std::ptrdiff_t pixel = j * tile.row_pixels + i;
      float* HWY_RESTRICT sheet = tile.sheet + 4 * pixel;
      float* HWY_RESTRICT accumulated = tile.accumulated + 4 * pixel;
      auto r = zero, g = zero, b = zero, a = zero;
      hn::LoadInterleaved4(d, sheet, r, g, b, a);
      auto acc_r = zero, acc_g = zero, acc_b = zero, acc_a = zero;
      hn::LoadInterleaved4(d, accumulated, acc_r, acc_g, acc_b, acc_a);

      auto alpha = hn::Min(a, one);
      if constexpr (kPerspective) {
        // 1 - (1 - alpha)^r; the logarithm of 0 is kept finite, its exponential is 0 all the same.
        const auto rest = hn::Max(hn::Sub(one, alpha), hn::Set(d, 1e-37F));
        const auto power = hn::Exp(d, hn::Mul(hn::LoadU(d, tile.distance_ratio + pixel), hn::Log(d, rest)));
        alpha = hn::IfThenElse(hn::Lt(alpha, one), hn::Sub(one, power), one);
      }
      auto visible = hn::Gt(a, zero);
      if (tile.owned_begin != nullptr) {
        const auto column = hn::Iota(d, float(i));
        visible = hn::And(
            visible, hn::And(hn::Ge(column, hn::Set(d, float(tile.owned_begin[j]))), hn::Lt(column, hn::Set(d, float(tile.owned_end[j])))));
      }
      alpha = hn::IfThenElseZero(visible, alpha);
      const auto covered = hn::Mul(hn::Sub(one, acc_a), alpha);
      const auto weight = hn::IfThenElseZero(visible, hn::Div(covered, hn::IfThenElse(visible, a, one)));
      acc_a = hn::Add(acc_a, covered);
      hn::StoreInterleaved4(hn::MulAdd(weight, r, acc_r), hn::MulAdd(weight, g, acc_g), hn::MulAdd(weight, b, acc_b), acc_a, d,
                            accumulated);
      hn::StoreInterleaved4(zero, zero, zero, zero, d, sheet);
      least = hn::Min(least, acc_a);
    }
  }
  return hn::GetLane(hn::MinOfLanes(d, least));
}

float CompositeOrthographic(const TileWork& tile) { return Composite<false>(tile); }
float CompositePerspective(const TileWork& tile) { return Composite<true>(tile); }

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(CompositeOrthographic);
HWY_EXPORT(CompositePerspective);

float CompositeTile(const TileWork& tile) {
  return tile.distance_ratio == nullptr ? HWY_DYNAMIC_DISPATCH(CompositeOrthographic)(tile)
                                        : HWY_DYNAMIC_DISPATCH(CompositePerspective)(tile);
}

}  // namespace slabstream
#endif
