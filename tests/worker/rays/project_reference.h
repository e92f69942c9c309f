// The definition of ProjectTile: one ray and one sample after the other. The same bits.
#pragma once

#include "worker/rays/project.h"

namespace slabstream::testing {

void ProjectTileReference(const ProjectWork& work, const PixelBounds& tile, float* pixels, std::size_t floats_a_row);

}  // namespace slabstream::testing
