// Reconstruction along one axis by a CubicKernel. Included once for each instruction set, hence the unusual include guard.
#include <hwy/highway.h>

#include <limits>

#include "worker/rays/ray_packet-inl.h"
#include "worker/renderers/shear/cubic_kernel.h"

#if defined(SLABSTREAM_WORKER_RENDERERS_SHEAR_RECONSTRUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SLABSTREAM_WORKER_RENDERERS_SHEAR_RECONSTRUCT_INL_H_
#undef SLABSTREAM_WORKER_RENDERERS_SHEAR_RECONSTRUCT_INL_H_
#else
#define SLABSTREAM_WORKER_RENDERERS_SHEAR_RECONSTRUCT_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace {

constexpr float kLargest = std::numeric_limits<float>::max();

// The four weights of CubicKernel.
struct Weights {
  Floats before, at, next, behind;
};
HWY_INLINE Weights WeightsAt(const shear::CubicKernel& kernel, Floats t) {
  const auto polynomial = [&](const std::array<float, 4>& c) SLABSTREAM_INLINED {
    return hn::Add(Set(c[0]), hn::Mul(t, hn::Add(Set(c[1]), hn::Mul(t, hn::Add(Set(c[2]), hn::Mul(t, Set(c[3])))))));
  };
  Weights w;
  w.before = polynomial(kernel.before);
  w.at = polynomial(kernel.at);
  w.behind = polynomial(kernel.behind);
  w.next = hn::Sub(Set(1), hn::Add(hn::Add(w.before, w.behind), w.at));
  return w;
}

// Not finite if one of the samples is not.
HWY_INLINE Floats Reconstruct(const Weights& w, Floats a, Floats b, Floats c, Floats d) {
  const auto sum = hn::Add(hn::Add(hn::Mul(w.before, a), hn::Mul(w.at, b)), hn::Add(hn::Mul(w.next, c), hn::Mul(w.behind, d)));
  const auto low = hn::Min(hn::Min(a, b), hn::Min(c, d)), high = hn::Max(hn::Max(a, b), hn::Max(c, d));
  const auto finite = hn::Le(hn::Abs(sum), Set(kLargest));
  return hn::IfThenElse(finite, hn::Min(hn::Max(sum, low), high), sum);
}

// The four samples of a beam from sample `at` on, lane by lane.
struct Four {
  Floats a, b, c, d;
};
HWY_INLINE Four LoadFour(const std::uint8_t* beam, Ints at) {
  const FloatTag df;
  const auto word = hn::GatherOffset(IntTag(), reinterpret_cast<const std::int32_t*>(beam), at);
  const auto byte = SetInt(0xFF);
  return {hn::ConvertTo(df, hn::And(word, byte)), hn::ConvertTo(df, hn::And(hn::ShiftRight<8>(word), byte)),
          hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(word), byte)), hn::ConvertTo(df, hn::And(hn::ShiftRight<24>(word), byte))};
}
HWY_INLINE Four LoadFour(const std::uint16_t* beam, Ints at) {
  const FloatTag df;
  const auto offset = hn::Add(at, at), low = SetInt(0xFFFF);
  const auto* const words = reinterpret_cast<const std::int32_t*>(beam);
  const auto first = hn::GatherOffset(IntTag(), words, offset), second = hn::GatherOffset(IntTag(), words + 1, offset);
  return {hn::ConvertTo(df, hn::And(first, low)), hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(first), low)),
          hn::ConvertTo(df, hn::And(second, low)), hn::ConvertTo(df, hn::And(hn::ShiftRight<16>(second), low))};
}
HWY_INLINE Four LoadFour(const float* beam, Ints at) {
  const FloatTag df;
  return {hn::GatherIndex(df, beam, at), hn::GatherIndex(df, beam + 1, at), hn::GatherIndex(df, beam + 2, at),
          hn::GatherIndex(df, beam + 3, at)};
}

}  // namespace
}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
