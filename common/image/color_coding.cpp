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

#if HWY_TARGET == HWY_SCALAR

bool ToCodes(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  return ToCodesReference(coding, values, codes, count);
}
void FromCodes(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  FromCodesReference(coding, codes, values, count);
}

#else

using Floats = hn::ScalableTag<float>;
using Words = hn::RebindToUnsigned<Floats>;
using Integers = hn::RebindToSigned<Floats>;
using Codes = hn::Rebind<std::uint16_t, Floats>;
constexpr std::uint32_t kBias = std::uint32_t{127 - 15} << 23;

struct Half {
  template <class V>
  static auto ToCode(V values) {
    const Floats df;
    const Words du;
    const auto half = hn::Set(df, 0.5F);
    const auto small = hn::Sub(hn::BitCast(du, hn::Add(values, half)), hn::BitCast(du, half));
    const auto bits = hn::Sub(hn::BitCast(du, values), hn::Set(du, kBias));
    const auto odd = hn::And(hn::ShiftRight<13>(bits), hn::Set(du, 1));
    const auto normal = hn::ShiftRight<13>(hn::Add(hn::Add(bits, hn::Set(du, 0xFFF)), odd));
    const auto is_small = hn::RebindMask(du, hn::Lt(values, hn::Set(df, 0x1p-14F)));
    return hn::BitCast(Integers(), hn::IfThenElse(is_small, small, normal));
  }
  template <class V>
  static auto FromCode(V codes) {  // of Words
    const Floats df;
    const Words du;
    const auto small = hn::Mul(hn::ConvertTo(df, hn::BitCast(Integers(), codes)), hn::Set(df, 0x1p-24F));
    const auto normal = hn::BitCast(df, hn::Add(hn::ShiftLeft<13>(codes), hn::Set(du, kBias)));
    const auto is_small = hn::RebindMask(df, hn::Lt(hn::BitCast(Integers(), codes), hn::Set(Integers(), 0x400)));
    return hn::IfThenElse(is_small, small, normal);
  }
};

struct Fixed {
  template <class V>
  static auto ToCode(V values) {
    return hn::NearestInt(hn::Mul(values, hn::Set(Floats(), 65535.0F)));
  }
  template <class V>
  static auto FromCode(V codes) {
    return hn::Div(hn::ConvertTo(Floats(), hn::BitCast(Integers(), codes)), hn::Set(Floats(), 65535.0F));
  }
};

template <class Coding>
bool ToCodesOf(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  const Floats df;
  const std::size_t lanes = hn::Lanes(df);
  auto inside = hn::Eq(hn::Zero(df), hn::Zero(df));
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto v = hn::LoadU(df, values + i);
    inside = hn::And(inside, hn::And(hn::Ge(v, hn::Zero(df)), hn::Le(v, hn::Set(df, kLargestColor))));
    hn::StoreU(hn::DemoteTo(Codes(), Coding::ToCode(v)), Codes(), codes + i);
  }
  return hn::AllTrue(df, inside) && ToCodesReference(coding, values + i, codes + i, count - i);
}

template <class Coding>
void FromCodesOf(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  const Floats df;
  const std::size_t lanes = hn::Lanes(df);
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    hn::StoreU(Coding::FromCode(hn::PromoteTo(Words(), hn::LoadU(Codes(), codes + i))), df, values + i);
  }
  FromCodesReference(coding, codes + i, values + i, count - i);
}

bool ToCodes(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  return coding == ColorCoding::kHalf ? ToCodesOf<Half>(coding, values, codes, count) : ToCodesOf<Fixed>(coding, values, codes, count);
}
void FromCodes(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  coding == ColorCoding::kHalf ? FromCodesOf<Half>(coding, codes, values, count) : FromCodesOf<Fixed>(coding, codes, values, count);
}

#endif

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
