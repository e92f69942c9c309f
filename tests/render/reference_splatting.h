// The definition of docs/rendering.md, as it stands: every voxel, every pixel, double precision, no tables, no skipping. Slow: small
// volumes and images only.
#pragma once

#include "worker/render/pipeline.h"

namespace slabstream::testing {

// The whole volume; the image covers the whole frame. setup.termination is not used.
LocalImage ReferenceSplatting(const Volume& volume, const FrameSetup& setup);

}  // namespace slabstream::testing
