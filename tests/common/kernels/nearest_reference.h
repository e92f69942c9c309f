// The definition of NearestRow in plain code. The same bits.
#pragma once

#include "common/kernels/combine.h"

namespace slabstream::testing {

void NearestRowReference(const SourcePixels& source, const TargetPixels& target, std::size_t pixel_count);

}  // namespace slabstream::testing
