// ExpOfMinus for vectors of floats. Included once for each instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include <numbers>

#if defined(SLABSTREAM_WORKER_LIGHT_EXPONENTIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_LIGHT_EXPONENTIAL_INL_H_
#undef SLABSTREAM_WORKER_LIGHT_EXPONENTIAL_INL_H_
#else
#define SLABSTREAM_WORKER_LIGHT_EXPONENTIAL_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {

// exp(-x) for x >= 0, within 1e-5 of it, relatively, and at least exp(-80). Each multiplication and addition is rounded, so every
// instruction set gives the same bits.
template <class V>
HWY_INLINE V ExpOfMinus(V x) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::DFromV<V> df;
  const hn::RebindToSigned<decltype(df)> di;
  const auto set = [&](float value) HWY_ATTR { return hn::Set(df, value); };
  const auto power = hn::Mul(hn::Min(x, set(80)), set(float(-1 / std::numbers::ln2)));
  const auto whole = hn::Floor(hn::Add(power, set(0.5F)));
  const auto rest = hn::Mul(hn::Sub(power, whole), set(float(std::numbers::ln2)));  // [-0.35, 0.35]
  auto result = set(1.0F / 120);
  for (float coefficient : {1.0F / 24, 1.0F / 6, 1.0F / 2, 1.0F, 1.0F}) result = hn::Add(hn::Mul(result, rest), set(coefficient));
  const auto scale = hn::BitCast(df, hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, 127))));
  return hn::Mul(result, scale);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
