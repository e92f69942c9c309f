// Colour in 16 bits a channel, for images on their way between workers. Values must lie in [0, 1], as premultiplied colours do.
//
// kHalf: IEEE 754 binary16, rounded to the nearest, ties to even. Relative error at most 2^-11 (values of 2^-14 and more).
// kFixed16: round(65535 value). Absolute error at most 2^-17 (half of 1 / 65535, a little more than 2^-17: 7.63e-6).
// 0 and 1 are exact in both, and order is kept. Values slightly above 1, from rounded sums, become 1.
//
// Finished pictures may also travel as kStraight8, in 8 bits a channel: what a PNG of them holds (sample_codes.h). So may images of which
// combining takes the nearer pixel as it is (PixelFormat::kDepth): the picture has the same codes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabstream {

enum class ColorCoding : std::uint8_t { kFloat32 = 1, kHalf = 2, kFixed16 = 3, kStraight8 = 4 };

inline constexpr float kLargestColor = 1 + 0x1p-18F;  // the largest colour that can be coded

constexpr std::size_t BytesPerChannel(ColorCoding coding) {
  return coding == ColorCoding::kFloat32 ? 4 : coding == ColorCoding::kStraight8 ? 1 : 2;
}
// Larger codes stand for no value in [0, 1]. 16-bit codings only.
constexpr std::uint16_t LargestCode(ColorCoding coding) { return coding == ColorCoding::kHalf ? 0x3C00 : 0xFFFF; }

// The largest error of a channel of the picture, to first order, if all images of workers travel in this coding. `hops`: the most transfers
// in a row that any pixel's colours make. `transfers`: the most transfers of one pixel altogether.
//   kHalf: the images of one hop lie behind each other; their contributions to a channel add up to at most 1. So relative errors
//   u = 2^-11 of their colours move it by at most u, and errors of their alphas, through what lies behind them, by u once more.
//   kFixed16: errors are absolute, so each transfer counts, for its colour and its alpha.
constexpr double CodingError(ColorCoding coding, std::uint32_t hops, std::uint32_t transfers) {
  switch (coding) {
    case ColorCoding::kFloat32: return 0;
    case ColorCoding::kHalf: return double(hops) / 1024;
    case ColorCoding::kFixed16: return double(transfers) / 65535;
    case ColorCoding::kStraight8: break;
  }
  return 1;  // it is not for them
}

// Converts `count` values to codes of a 16-bit coding, and back; no alignment needed beyond the types'. ToCodes returns false, and the
// codes are undefined, if a value does not lie in [0, kLargestColor]. FromCodes takes codes up to LargestCode.
bool ToCodes(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count);
void FromCodes(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count);

}  // namespace slabstream
