// ToCodes and FromCodes for every instruction set that the compiler knows. The bits are the reference's.

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/image/color_coding.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/image/color_coding.h"

HWY_BEFORE_NAMESPACE();
namespace slabstream {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Words = hn::RebindToUnsigned<Floats>;
using Integers = hn::RebindToSigned<Floats>;
using Codes = hn::Rebind<std::uint16_t, Floats>;
constexpr std::uint32_t kBias = std::uint32_t{127 - 15} << 23;

template <ColorCoding coding, class V>
auto ToCode(V values) {  // Floats to Integers
  const Floats df;
  const Words du;
  if constexpr (coding == ColorCoding::kFixed16) {
    return hn::NearestInt(hn::Mul(values, hn::Set(df, 65535.0F)));
  } else {
    const auto half = hn::Set(df, 0.5F);
    const auto small = hn::Sub(hn::BitCast(du, hn::Add(values, half)), hn::BitCast(du, half));
    const auto bits = hn::Sub(hn::BitCast(du, values), hn::Set(du, kBias));
    const auto odd = hn::And(hn::ShiftRight<13>(bits), hn::Set(du, 1));
    const auto normal = hn::ShiftRight<13>(hn::Add(hn::Add(bits, hn::Set(du, 0xFFF)), odd));
    const auto is_small = hn::RebindMask(du, hn::Lt(values, hn::Set(df, 0x1p-14F)));
    return hn::BitCast(Integers(), hn::IfThenElse(is_small, small, normal));
  }
}

template <ColorCoding coding, class V>
auto FromCode(V codes) {  // Words to Floats
  const Floats df;
  const auto number = hn::BitCast(Integers(), codes);
  if constexpr (coding == ColorCoding::kFixed16) {
    return hn::Div(hn::ConvertTo(df, number), hn::Set(df, 65535.0F));
  } else {
    const auto small = hn::Mul(hn::ConvertTo(df, number), hn::Set(df, 0x1p-24F));
    const auto normal = hn::BitCast(df, hn::Add(hn::ShiftLeft<13>(codes), hn::Set(Words(), kBias)));
    return hn::IfThenElse(hn::RebindMask(df, hn::Lt(number, hn::Set(Integers(), 0x400))), small, normal);
  }
}

template <ColorCoding coding>
bool ToCodesOf(const float* values, std::uint16_t* codes, std::size_t count) {
  const Floats df;
  const std::size_t lanes = hn::Lanes(df);
  auto inside = hn::Eq(hn::Zero(df), hn::Zero(df));
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto v = hn::LoadU(df, values + i);
    inside = hn::And(inside, hn::And(hn::Ge(v, hn::Zero(df)), hn::Le(v, hn::Set(df, kLargestColor))));
    hn::StoreU(hn::DemoteTo(Codes(), ToCode<coding>(v)), Codes(), codes + i);
  }
  return hn::AllTrue(df, inside) && ToCodesReference(coding, values + i, codes + i, count - i);
}

template <ColorCoding coding>
void FromCodesOf(const std::uint16_t* codes, float* values, std::size_t count) {
  const Floats df;
  const std::size_t lanes = hn::Lanes(df);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::StoreU(FromCode<coding>(hn::PromoteTo(Words(), hn::LoadU(Codes(), codes + i))), df, values + i);
  }
  FromCodesReference(coding, codes + i, values + i, count - i);
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
