// The definition of MarchTile: one ray and one sample after the other, without leaps. Within 1e-5 of it where `termination` is 0; with
// isosurfaces within 1e-3, except where a ray merely touches one.
#pragma once

#include "worker/renderers/raycast/march.h"

namespace slabstream::testing {

void MarchTileReference(const MarchWork& work, const PixelBounds& tile, float* rgba, std::size_t floats_a_row);

}  // namespace slabstream::testing
