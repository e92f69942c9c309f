// The definitions of SampleCodes and StraightCodes in plain code.
#pragma once

#include "common/image/sample_codes.h"

namespace slabstream::testing {

void SampleCodesReference(const float* samples, std::size_t count, std::uint8_t* codes);

void StraightCodesReference(const float* premultiplied, std::size_t pixels, std::uint8_t* codes, const Premultiplied& behind);
void StraightCodesReference(const float* premultiplied, std::size_t pixels, std::uint16_t* codes, const Premultiplied& behind);

}  // namespace slabstream::testing
