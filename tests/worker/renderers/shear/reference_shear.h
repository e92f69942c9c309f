// The definition of multi-pass shears in docs/rendering.md, as it stands: every sample by itself, from the voxels of the whole volume, in
// double precision, without tiles or skipping. Slow: small volumes and images only.
#pragma once

#include "worker/renderers/renderer.h"

namespace slabstream::testing {

// Renders the whole volume, which is not clipped; the image covers the whole frame. setup.termination is not used, nor
// is gradient opacity.
LocalImage ReferenceShear(const Volume& volume, const FrameSetup& setup);

}  // namespace slabstream::testing
