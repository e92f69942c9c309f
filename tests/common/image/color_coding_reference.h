// The definitions of ToCodes and FromCodes in plain code.
#pragma once

#include "common/image/color_coding.h"

namespace slabstream::testing {

bool ToCodesReference(ColorCoding coding, const float* values, std::uint16_t* codes, std::size_t count);
void FromCodesReference(ColorCoding coding, const std::uint16_t* codes, float* values, std::size_t count);

}  // namespace slabstream::testing
