// OverRow for every instruction set that the compiler knows; the best one that the CPU has is chosen at the first call. Multiplication and
// addition are kept apart (and this file is compiled without contraction), so every instruction set, and vector and tail, give the
// reference's bits; the loop waits for memory, not for arithmetic.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/kernels/over.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/kernels/combine.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

void OverRow(const float* front, const float* back, float* out, std::size_t pixel_count) {
  OverRowReference(front, back, out, pixel_count);
}

#else

// As many pixels as one vector of D holds.
template <class D>
HWY_INLINE void OverVector(D d, const float* front, const float* back, float* out) {
  const auto f = hn::LoadU(d, front);
  const auto transmittance = hn::Sub(hn::Set(d, 1.0F), hn::Broadcast<3>(f));  // of alpha, within each 128-bit block: one pixel
  hn::StoreU(hn::Add(f, hn::Mul(transmittance, hn::LoadU(d, back))), d, out);
}

void OverRow(const float* front, const float* back, float* out, std::size_t pixel_count) {
  const hn::ScalableTag<float> wide;
  const hn::FixedTag<float, 4> pixel;
  const std::size_t lanes = hn::Lanes(wide), count = 4 * pixel_count;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) OverVector(wide, front + i, back + i, out + i);
  for (; i < count; i += 4) OverVector(pixel, front + i, back + i, out + i);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {

HWY_EXPORT(OverRow);

void OverRow(const float* front, const float* back, float* out, std::size_t pixel_count) {
  HWY_DYNAMIC_DISPATCH(OverRow)(front, back, out, pixel_count);
}

}  // namespace slabstream
#endif
