// Whole numbers for the samples of a picture, as files and messages hold them: round(max * sample), halves up, without a transfer curve.
// Samples are finite; those outside [0, 1] are clamped. All instruction sets give the same codes. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabstream {

// Of each sample. Of premultiplied colours these are the colours over black.
void SampleCodes(const float* samples, std::size_t count, std::uint8_t* codes);

// `premultiplied`: [pixel][4], as `codes`, which hold the colours before they were multiplied by alpha; 0 where alpha is 0.
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint8_t* codes);
void StraightCodes(const float* premultiplied, std::size_t pixels, std::uint16_t* codes);

}  // namespace slabstream
