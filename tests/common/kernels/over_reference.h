// The definition of OverRow in plain code.
#pragma once

#include "common/kernels/combine.h"

namespace slabstream {

bool OverRowReference(const float* front, const float* back, float* out, std::size_t pixel_count);

}  // namespace slabstream
