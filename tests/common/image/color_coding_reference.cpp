#include "tests/common/image/color_coding_reference.h"

#include <bit>
#include <cmath>

namespace slabstream::testing {
namespace {

constexpr float kSmallestNormal = 0x1p-14F;  // of binary16

std::uint16_t ToHalf(float value) {
  // Subnormal halves have the step 2^-24, like floats from 0.5 to 1: adding 0.5 rounds.
  if (value < kSmallestNormal) return std::uint16_t(std::bit_cast<std::uint32_t>(value + 0.5F) - std::bit_cast<std::uint32_t>(0.5F));
  const auto bits = std::bit_cast<std::uint32_t>(value) - (std::uint32_t{127 - 15} << 23);  // another bias of the exponent
  return std::uint16_t((bits + 0xFFF + ((bits >> 13) & 1)) >> 13);
}

float FromHalf(std::uint16_t code) {
  if (code < 0x400) return float(code) * 0x1p-24F;
  return std::bit_cast<float>((std::uint32_t{code} << 13) + (std::uint32_t{127 - 15} << 23));
}

}  // namespace

bool ToCodesReference(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const float value = values[i];
    if (!(value >= 0 && value <= kLargestColor)) return false;
    codes[i] = coding == ColorCoding::kHalf ? ToHalf(value) : std::uint16_t(std::lrint(value * 65535));
  }
  return true;
}

void FromCodesReference(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) values[i] = coding == ColorCoding::kHalf ? FromHalf(codes[i]) : float(codes[i]) / 65535;
}

}  // namespace slabstream::testing
