// OverRow for every instruction set that the compiler knows; the best one that the CPU has is chosen at the first call. Products and sums
// are not fused (this file is compiled without contraction), so all instruction sets, and vector and tail, give the reference's bits. The
// loop waits for memory, not for arithmetic.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/kernels/over.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstdint>

#include "common/kernels/combine.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// As many pixels as one vector of D holds. Returns the bits of what it wrote, without signs.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToUnsigned<D> > OverVector(D d, const float* front, const float* back, float* out) {
  const hn::RebindToUnsigned<D> du;
  const auto f = hn::LoadU(d, front);
  const auto transmittance = hn::Sub(hn::Set(d, 1.0F), hn::Broadcast<3>(f));  // of alpha, within each 128-bit block: one pixel
  const auto sum = hn::Add(f, hn::Mul(transmittance, hn::LoadU(d, back)));
  hn::StoreU(sum, d, out);
  return hn::And(hn::BitCast(du, sum), hn::Set(du, 0x7FFFFFFF));
}

bool OverRow(const float* front, const float* back, float* out, std::size_t pixel_count) {
  constexpr std::uint32_t kInfinity = 0x7F800000;  // without a sign, the bits of all finite numbers are smaller, those of NaNs larger
  const hn::ScalableTag<float> wide;
  const hn::FixedTag<float, 4> pixel;
  const hn::RebindToUnsigned<decltype(wide)> wide_bits;
  const hn::RebindToUnsigned<decltype(pixel)> pixel_bits;
  const std::size_t lanes = hn::Lanes(wide), count = 4 * pixel_count;
  auto largest = hn::Zero(wide_bits);
  auto largest_of_tail = hn::Zero(pixel_bits);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) largest = hn::Max(largest, OverVector(wide, front + i, back + i, out + i));
  for (; i < count; i += 4) largest_of_tail = hn::Max(largest_of_tail, OverVector(pixel, front + i, back + i, out + i));
  return hn::AllTrue(wide_bits, hn::Lt(largest, hn::Set(wide_bits, kInfinity))) &&
         hn::AllTrue(pixel_bits, hn::Lt(largest_of_tail, hn::Set(pixel_bits, kInfinity)));
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {

HWY_EXPORT(OverRow);

bool OverRow(const float* front, const float* back, float* out, std::size_t pixel_count) {
  return HWY_DYNAMIC_DISPATCH(OverRow)(front, back, out, pixel_count);
}

}  // namespace slabstream
#endif
