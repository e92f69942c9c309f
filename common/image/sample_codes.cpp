// The codes of samples for every instruction set that the compiler knows; the best one that the CPU has is chosen at the first call.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/image/sample_codes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "common/image/sample_codes.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using OneTag = hn::CappedTag<float, 1>;
constexpr float kMax8 = std::numeric_limits<std::uint8_t>::max();

// As many samples as D has lanes.
template <class D, class Code>
HWY_INLINE void StoreCodes(D d, hn::Vec<D> samples, Code* codes) {
  const hn::RebindToSigned<D> di;
  const hn::Rebind<Code, D> dc;
  const auto clamped = hn::Min(hn::Max(samples, hn::Zero(d)), hn::Set(d, 1.0F));
  const auto value = hn::Mul(hn::Set(d, float(std::numeric_limits<Code>::max())), clamped);
  const auto whole = hn::ConvertTo(di, value);  // cut off
  // The difference is exact, unlike a sum with a half.
  const auto rounds_up = hn::Ge(hn::Sub(value, hn::ConvertTo(d, whole)), hn::Set(d, 0.5F));
  hn::StoreU(hn::DemoteTo(dc, hn::Sub(whole, hn::VecFromMask(di, hn::RebindMask(di, rounds_up)))), dc, codes);
}

void Plain8(const float* samples, std::size_t count, std::uint8_t* codes) {
  const FloatTag d;
  const OneTag one;
  std::size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) StoreCodes(d, hn::LoadU(d, samples + i), codes + i);
  for (; i < count; ++i) StoreCodes(one, hn::LoadU(one, samples + i), codes + i);
}

template <class Code>
HWY_INLINE void Straight(const float* rgba, std::size_t pixels, Code* codes, const Premultiplied& behind) {
  constexpr float max = std::numeric_limits<Code>::max();
  const std::size_t count = 4 * pixels;
  std::size_t i = 0;
  const FloatTag d;
  const hn::RebindToUnsigned<FloatTag> du;
  const auto is_alpha = hn::RebindMask(d, hn::Eq(hn::And(hn::Iota(du, 0), hn::Set(du, 3)), hn::Set(du, 3)));
  const auto back = hn::LoadDup128(d, behind.data());
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const auto front = hn::LoadU(d, rgba + i);
    const auto color = hn::Add(front, hn::Mul(hn::Sub(hn::Set(d, 1.0F), hn::Broadcast<3>(front)), back));
    const auto alpha = hn::Broadcast<3>(color);  // within each 128-bit block: one pixel
    const auto straight = hn::Div(color, hn::IfThenElse(is_alpha, hn::Set(d, 1.0F), alpha));
    const auto shows = hn::Ge(hn::Mul(hn::Set(d, max), alpha), hn::Set(d, 0.5F));
    StoreCodes(d, hn::IfThenElseZero(shows, straight), codes + i);
  }
  const auto over = [&](std::size_t at) { return rgba[at] + (1 - rgba[at | 3]) * behind[at % 4]; };
  for (; i < count; ++i) {
    const float alpha = over(i | 3), sample = i % 4 == 3 ? alpha : max * alpha >= 0.5F ? over(i) / alpha : 0;
    StoreCodes(OneTag(), hn::Set(OneTag(), sample), codes + i);
  }
}

void FromStraight8(const std::uint8_t* codes, std::size_t pixels, float* rgba) {
  const std::size_t count = 4 * pixels;
  std::size_t i = 0;
  const FloatTag d;
  const hn::RebindToSigned<FloatTag> di;
  const hn::RebindToUnsigned<FloatTag> du;
  const hn::Rebind<std::uint8_t, FloatTag> dc;
  const auto is_alpha = hn::RebindMask(d, hn::Eq(hn::And(hn::Iota(du, 0), hn::Set(du, 3)), hn::Set(du, 3)));
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const auto straight = hn::Div(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(dc, codes + i))), hn::Set(d, kMax8));
    const auto factor = hn::IfThenElse(is_alpha, hn::Set(d, 1.0F), hn::Broadcast<3>(straight));
    hn::StoreU(hn::Mul(straight, factor), d, rgba + i);
  }
  for (; i < count; ++i) rgba[i] = float(codes[i]) / kMax8 * (i % 4 == 3 ? 1 : float(codes[i | 3]) / kMax8);
}

void Straight8(const float* rgba, std::size_t pixels, std::uint8_t* codes, const Premultiplied& behind) {
  Straight(rgba, pixels, codes, behind);
}
void Straight16(const float* rgba, std::size_t pixels, std::uint16_t* codes, const Premultiplied& behind) {
  Straight(rgba, pixels, codes, behind);
}

}  // namespace slabstream::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {
HWY_EXPORT(Plain8);
HWY_EXPORT(Straight8);
HWY_EXPORT(Straight16);
HWY_EXPORT(FromStraight8);

void SampleCodes(const float* samples, std::size_t count, std::uint8_t* codes) { HWY_DYNAMIC_DISPATCH(Plain8)(samples, count, codes); }
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint8_t* codes, const Premultiplied& behind) {
  HWY_DYNAMIC_DISPATCH(Straight8)(premultiplied, pixels, codes, behind);
}
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint16_t* codes, const Premultiplied& behind) {
  HWY_DYNAMIC_DISPATCH(Straight16)(premultiplied, pixels, codes, behind);
}
void FillStraightCodes(const Premultiplied& color, std::span<std::uint8_t> codes) {
  std::array<std::uint8_t, 4> code;
  StraightCodes(color.data(), 1, code.data());
  for (std::size_t i = 0; i < codes.size(); i += code.size()) std::ranges::copy(code, &codes[i]);
}
void FromStraightCodes(const std::uint8_t* codes, std::size_t pixels, float* premultiplied) {
  HWY_DYNAMIC_DISPATCH(FromStraight8)(codes, pixels, premultiplied);
}

}  // namespace slabstream
#endif
