// The definitions of the kernels of clip_rows.h in plain code. The same bits.
#pragma once

#include "worker/kernels/clip_rows.h"

namespace slabstream::testing {

void RegionDepthsReference(const RegionRow& row, std::int32_t column, std::size_t count, float* enter, float* leave);

void VoxelsAtReference(const RayRow& row, std::int32_t column, std::size_t count, const float* depth, double behind, std::int32_t* x,
                       std::int32_t* y, std::int32_t* z);

}  // namespace slabstream::testing
