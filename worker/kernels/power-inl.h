// PowerOfFraction for vectors of floats. Included once for each instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include <numbers>

#if defined(SLABSTREAM_WORKER_KERNELS_POWER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_KERNELS_POWER_INL_H_
#undef SLABSTREAM_WORKER_KERNELS_POWER_INL_H_
#else
#define SLABSTREAM_WORKER_KERNELS_POWER_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// base^exponent for base in [0, 1]: 2^(exponent log2(base)). Each multiplication and addition is rounded, so every instruction set gives
// the same bits. PowerOfFractionFloat in shade_faces_reference.cpp does the same operations in the same order.
template <class V>
HWY_INLINE V PowerOfFraction(V base, V exponent) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::DFromV<V> df;
  const hn::RebindToSigned<decltype(df)> di;
  const auto set = [&](float value) HWY_ATTR { return hn::Set(df, value); };
  const auto positive = hn::Gt(base, hn::Zero(df));
  // m in [sqrt(1/2), sqrt(2)): the mantissa's upper part is moved to the next exponent.
  const auto bits = hn::BitCast(di, base);
  const auto e = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, 0x3F3504F3)));
  const auto m = hn::BitCast(df, hn::Sub(bits, hn::ShiftLeft<23>(e)));
  const auto s = hn::Div(hn::Sub(m, set(1)), hn::Add(m, set(1))), s2 = hn::Mul(s, s);
  auto series = set(1.0F / 7);
  for (float coefficient : {1.0F / 5, 1.0F / 3, 1.0F}) series = hn::Add(hn::Mul(series, s2), set(coefficient));
  const auto log2 = hn::Add(hn::ConvertTo(df, e), hn::Mul(hn::Mul(s, series), set(float(2 / std::numbers::ln2))));
  const auto power = hn::Max(hn::Mul(log2, exponent), set(-126));
  const auto whole = hn::Floor(hn::Add(power, set(0.5F)));
  const auto rest = hn::Mul(hn::Sub(power, whole), set(float(std::numbers::ln2)));
  auto result = set(1.0F / 720);
  for (float coefficient : {1.0F / 120, 1.0F / 24, 1.0F / 6, 1.0F / 2, 1.0F, 1.0F}) {
    result = hn::Add(hn::Mul(result, rest), set(coefficient));
  }
  const auto scale = hn::BitCast(df, hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, 127))));
  return hn::IfThenElseZero(positive, hn::Mul(result, scale));
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
