// Whole numbers for the samples of a picture, as files and messages hold them: round(max * sample), halves up, without a transfer curve.
// Samples are finite; those outside [0, 1] are clamped. All instruction sets give the same codes. Any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace slabstream {

// The code of each sample. If colours are premultiplied, the codes are those of the colours over black.
void SampleCodes(const float* samples, std::size_t count, std::uint8_t* codes);

using Premultiplied = std::array<float, 4>;

// `premultiplied`: [pixel][4], as `codes`, which hold the colours before they were multiplied by alpha; 0 where the code of alpha is 0.
// They are those of the pixels over `behind` (OverRow), which leaves them as they are if it is empty.
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint8_t* codes, const Premultiplied& behind = {});
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint16_t* codes, const Premultiplied& behind = {});

// The codes of one colour, in every pixel of `codes`.
void FillStraightCodes(const Premultiplied& color, std::span<std::uint8_t> codes);

// The premultiplied colours that 8-bit codes stand for. StraightCodes of them are the same codes again, except that colours without alpha
// become 0.
void FromStraightCodes(const std::uint8_t* codes, std::size_t pixels, float* premultiplied);

}  // namespace slabstream
