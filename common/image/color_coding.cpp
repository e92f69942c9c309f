// ToCodes and FromCodes for every instruction set that the compiler knows. All give the same bits.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/image/color_coding.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/image/color_coding.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t kBias = std::uint32_t{127 - 15} << 23;  // between the exponents of binary16 and float

// As many values as D has lanes. Returns which of them can be coded.
template <ColorCoding coding, class D>
HWY_INLINE hn::Mask<D> CodeValues(D df, const float* values, std::uint16_t* codes) {
  const hn::RebindToUnsigned<D> du;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> dc;
  const auto v = hn::LoadU(df, values);
  if constexpr (coding == ColorCoding::kFixed16) {
    hn::StoreU(hn::DemoteTo(dc, hn::NearestInt(hn::Mul(v, hn::Set(df, 65535.0F)))), dc, codes);
  } else {
    // Subnormal halves have the step 2^-24, like floats from 0.5 to 1: adding 0.5 rounds.
    const auto half = hn::Set(df, 0.5F);
    const auto small = hn::Sub(hn::BitCast(du, hn::Add(v, half)), hn::BitCast(du, half));
    const auto bits = hn::Sub(hn::BitCast(du, v), hn::Set(du, kBias));
    const auto odd = hn::And(hn::ShiftRight<13>(bits), hn::Set(du, 1));
    const auto normal = hn::ShiftRight<13>(hn::Add(hn::Add(bits, hn::Set(du, 0xFFF)), odd));
    const auto is_small = hn::RebindMask(du, hn::Lt(v, hn::Set(df, 0x1p-14F)));
    hn::StoreU(hn::DemoteTo(dc, hn::BitCast(di, hn::IfThenElse(is_small, small, normal))), dc, codes);
  }
  return hn::And(hn::Ge(v, hn::Zero(df)), hn::Le(v, hn::Set(df, kLargestColor)));
}

template <ColorCoding coding, class D>
HWY_INLINE void ReadCodes(D df, const std::uint16_t* codes, float* values) {
  const hn::RebindToUnsigned<D> du;
  const hn::RebindToSigned<D> di;
  const hn::Rebind<std::uint16_t, D> dc;
  const auto bits = hn::PromoteTo(du, hn::LoadU(dc, codes));
  const auto number = hn::BitCast(di, bits);
  if constexpr (coding == ColorCoding::kFixed16) {
    hn::StoreU(hn::Div(hn::ConvertTo(df, number), hn::Set(df, 65535.0F)), df, values);
  } else {
    const auto small = hn::Mul(hn::ConvertTo(df, number), hn::Set(df, 0x1p-24F));
    const auto normal = hn::BitCast(df, hn::Add(hn::ShiftLeft<13>(bits), hn::Set(du, kBias)));
    hn::StoreU(hn::IfThenElse(hn::RebindMask(df, hn::Lt(number, hn::Set(di, 0x400))), small, normal), df, values);
  }
}

template <ColorCoding coding>
bool ToCodesOf(const float* values, std::uint16_t* codes, std::size_t count) {
  const hn::ScalableTag<float> df;
  const hn::CappedTag<float, 1> one;
  auto inside = hn::Eq(hn::Zero(df), hn::Zero(df));
  auto rest_inside = hn::Eq(hn::Zero(one), hn::Zero(one));
  std::size_t i = 0;
  for (; i + hn::Lanes(df) <= count; i += hn::Lanes(df)) inside = hn::And(inside, CodeValues<coding>(df, values + i, codes + i));
  for (; i < count; ++i) rest_inside = hn::And(rest_inside, CodeValues<coding>(one, values + i, codes + i));
  return hn::AllTrue(df, inside) && hn::AllTrue(one, rest_inside);
}

template <ColorCoding coding>
void FromCodesOf(const std::uint16_t* codes, float* values, std::size_t count) {
  const hn::ScalableTag<float> df;
  std::size_t i = 0;
  for (; i + hn::Lanes(df) <= count; i += hn::Lanes(df)) ReadCodes<coding>(df, codes + i, values + i);
  for (; i < count; ++i) ReadCodes<coding>(hn::CappedTag<float, 1>(), codes + i, values + i);
}

bool ToCodes(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  return (coding == ColorCoding::kHalf ? ToCodesOf<ColorCoding::kHalf> : ToCodesOf<ColorCoding::kFixed16>)(values, codes, count);
}
void FromCodes(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  (coding == ColorCoding::kHalf ? FromCodesOf<ColorCoding::kHalf> : FromCodesOf<ColorCoding::kFixed16>)(codes, values, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace slabstream
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace slabstream {

HWY_EXPORT(ToCodes);
HWY_EXPORT(FromCodes);

bool ToCodes(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  return HWY_DYNAMIC_DISPATCH(ToCodes)(coding, values, codes, count);
}
void FromCodes(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  HWY_DYNAMIC_DISPATCH(FromCodes)(coding, codes, values, count);
}

}  // namespace slabstream
#endif
