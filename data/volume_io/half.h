// A half float as files hold it (IEEE 754 binary16): a sign, 5 bits of exponent, 10 of fraction. Arithmetic is that of float32, which
// holds every half exactly.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace slabstream {

struct Half {
  Half() = default;
  // The nearest half, ties to even; infinity above 65519.
  explicit Half(double value) : bits(BitsOf(value)) {}

  operator float() const {
    const int exponent = (bits >> 10) & 0x1f, fraction = bits & 0x3ff;
    const float sign = (bits & 0x8000) != 0 ? -1.0F : 1.0F;
    if (exponent == 0x1f) return fraction != 0 ? std::numeric_limits<float>::quiet_NaN() : sign * std::numeric_limits<float>::infinity();
    // Without the leading 1, subnormal numbers have the exponent of the least normal ones.
    return sign * (exponent == 0 ? std::ldexp(float(fraction), -24) : std::ldexp(float(fraction + 0x400), exponent - 25));
  }

  std::uint16_t bits = 0;

 private:
  static std::uint16_t BitsOf(double value) {
    const auto sign = std::uint16_t(std::signbit(value) ? 0x8000 : 0);
    if (std::isnan(value)) return sign | 0x7e00;
    const double magnitude = std::abs(value);
    if (magnitude >= 65520) return sign | 0x7c00;
    // Halves of this size lie 2^exponent apart; the code counts them from 0 on, through subnormal and normal numbers alike.
    const int exponent = magnitude < 0x1p-14 ? -24 : std::ilogb(magnitude) - 10;
    const auto steps = int(std::nearbyint(std::ldexp(magnitude, -exponent)));
    return std::uint16_t(sign | (steps + (exponent + 24) * 0x400));
  }
};

}  // namespace slabstream

template <>
struct std::numeric_limits<slabstream::Half> {
  static constexpr bool is_specialized = true, is_signed = true, is_integer = false;
  static slabstream::Half max() { return std::bit_cast<slabstream::Half>(std::uint16_t{0x7bff}); }
  static slabstream::Half lowest() { return std::bit_cast<slabstream::Half>(std::uint16_t{0xfbff}); }
  static slabstream::Half infinity() { return std::bit_cast<slabstream::Half>(std::uint16_t{0x7c00}); }
  static slabstream::Half quiet_NaN() { return std::bit_cast<slabstream::Half>(std::uint16_t{0x7e00}); }
};
