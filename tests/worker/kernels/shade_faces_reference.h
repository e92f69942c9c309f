// The definition of ShadeFaceRow in plain code. The same bits.
#pragma once

#include "worker/kernels/shade_faces.h"

namespace slabstream::testing {

void ShadeFaceRowReference(const FaceShading& shading, const std::uint64_t* keys, std::int32_t column, std::int32_t row, std::size_t count,
                           float* rgba, float* depth, std::uint32_t* voxel);

}  // namespace slabstream::testing
