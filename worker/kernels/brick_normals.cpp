#include "worker/kernels/brick_normals.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/kernels/brick_normals.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <bit>
#include <limits>

#include "worker/kernels/normal_code.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<float, 16>;  // divides kNormalRow and kNormalColumns
using V = hn::Vec<D>;

HWY_INLINE V Smooth(V below, V middle, V above) { return hn::Add(hn::Add(below, above), hn::Add(middle, middle)); }

HWY_INLINE V LoadFloats(const float* HWY_RESTRICT from) { return hn::Load(D(), from); }
template <class T>
HWY_INLINE V LoadFloats(const T* HWY_RESTRICT from) {
  const hn::RebindToSigned<D> di;
  return hn::ConvertTo(D(), hn::PromoteTo(di, hn::Load(hn::Rebind<T, D>(), from)));
}

template <class T>
HWY_INLINE void Sum(const NormalSamples<T>& samples, NormalSums& sums) {
  const D d;
  for (std::size_t i = 0; i < std::size_t{kNormalColumns}; i += hn::Lanes(d)) {
    V below = LoadFloats(samples.row[0] + i), middle = LoadFloats(samples.row[1] + i);
    for (int y = 0; y < kNormalRow; ++y) {
      const V above = LoadFloats(samples.row[y + 2] + i);
      hn::Store(Smooth(below, middle, above), d, sums.smooth[y] + i);
      hn::Store(hn::Sub(above, below), d, sums.slope[y] + i);
      below = middle;
      middle = above;
    }
  }
}

void Sum8(const NormalSamples<std::uint8_t>& samples, NormalSums& sums) { Sum(samples, sums); }
void Sum16(const NormalSamples<std::uint16_t>& samples, NormalSums& sums) { Sum(samples, sums); }
void SumFloat(const NormalSamples<float>& samples, NormalSums& sums) { Sum(samples, sums); }

// EncodeNormal of normal_code.h.
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> Code(V x, V y, V z) {
  const D d;
  const hn::RebindToSigned<D> di;
  const V zero = hn::Zero(d), half = hn::Set(d, 0.5F * (kNormalGrid - 1)), offset = hn::Set(d, 0.5F * (kNormalGrid - 1) + 0.5F);
  const V length = hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z));
  const auto valid = hn::And(hn::Gt(length, zero), hn::Le(length, hn::Set(d, std::numeric_limits<float>::max())));
  const V sign = hn::IfThenElse(hn::Lt(z, zero), hn::Set(d, -1.0F), hn::Set(d, 1.0F));
  const V scale = hn::Div(sign, hn::IfThenElse(valid, length, hn::Set(d, 1.0F)));
  const V px = hn::IfThenElseZero(valid, hn::Mul(x, scale)), py = hn::IfThenElseZero(valid, hn::Mul(y, scale));
  const auto most = hn::Set(di, kNormalGrid - 1);
  const auto u = hn::Min(hn::ConvertTo(di, hn::Add(hn::Mul(hn::Add(px, py), half), offset)), most);
  const auto v = hn::Min(hn::ConvertTo(di, hn::Add(hn::Mul(hn::Sub(px, py), half), offset)), most);
  const auto code = hn::Add(hn::Mul(v, hn::Set(di, kNormalGrid)), u);
  return hn::IfThenElse(hn::RebindMask(di, valid), code, hn::Set(di, kNoGradient));
}

void Encode(const NormalSums& below, const NormalSums& middle, const NormalSums& above, const NormalScales& scales, std::uint32_t rows,
            std::uint16_t (*codes)[kNormalRow]) {
  const D d;
  const hn::Rebind<std::uint16_t, D> d16;
  const std::size_t lanes = hn::Lanes(d);
  // Filled for all rows before any is read: a load right after a store at another offset is slow.
  alignas(64) float smooth[kNormalRow][kNormalColumns], along_y[kNormalRow][kNormalColumns], along_z[kNormalRow][kNormalColumns];
  for (std::uint32_t rest = rows; rest != 0; rest &= rest - 1) {
    const int y = std::countr_zero(rest);
    for (std::size_t i = 0; i < std::size_t{kNormalColumns}; i += lanes) {
      const V smooth_below = hn::Load(d, below.smooth[y] + i), smooth_above = hn::Load(d, above.smooth[y] + i);
      hn::Store(Smooth(smooth_below, hn::Load(d, middle.smooth[y] + i), smooth_above), d, smooth[y] + i);
      hn::Store(hn::Sub(smooth_above, smooth_below), d, along_z[y] + i);
      hn::Store(Smooth(hn::Load(d, below.slope[y] + i), hn::Load(d, middle.slope[y] + i), hn::Load(d, above.slope[y] + i)), d,
                along_y[y] + i);
    }
  }
  const V z_scale = hn::Set(d, scales.z);
  for (std::uint32_t rest = rows; rest != 0; rest &= rest - 1) {
    const int y = std::countr_zero(rest);
    const V y_scale = hn::Set(d, scales.y[std::size_t(y)]);
    for (std::size_t i = 0; i < std::size_t{kNormalRow}; i += lanes) {
      const auto three = [&](const float* sums) {
        return Smooth(hn::Load(d, sums + i), hn::LoadU(d, sums + i + 1), hn::LoadU(d, sums + i + 2));
      };
      const V x = hn::Mul(hn::LoadU(d, scales.x.data() + i), hn::Sub(hn::LoadU(d, smooth[y] + i + 2), hn::Load(d, smooth[y] + i)));
      hn::StoreU(hn::DemoteTo(d16, Code(x, hn::Mul(y_scale, three(along_y[y])), hn::Mul(z_scale, three(along_z[y])))), d16, codes[y] + i);
    }
  }
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Sum8);
HWY_EXPORT(Sum16);
HWY_EXPORT(SumFloat);
HWY_EXPORT(Encode);

void SumPlane(const NormalSamples<std::uint8_t>& samples, NormalSums& sums) { HWY_DYNAMIC_DISPATCH(Sum8)(samples, sums); }
void SumPlane(const NormalSamples<std::uint16_t>& samples, NormalSums& sums) { HWY_DYNAMIC_DISPATCH(Sum16)(samples, sums); }
void SumPlane(const NormalSamples<float>& samples, NormalSums& sums) { HWY_DYNAMIC_DISPATCH(SumFloat)(samples, sums); }

void EncodeNormals(const NormalSums& below, const NormalSums& middle, const NormalSums& above, const NormalScales& scales,
                   std::uint32_t rows, std::uint16_t (*codes)[kNormalRow]) {
  HWY_DYNAMIC_DISPATCH(Encode)(below, middle, above, scales, rows, codes);
}

}  // namespace slabstream
#endif
