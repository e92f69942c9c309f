// The definition of splatting in docs/rendering.md, as it stands: every voxel, every pixel, double precision, no tables, no skipping. Slow:
// small volumes and images only.
#pragma once

#include "worker/renderers/renderer.h"

namespace slabstream::testing {

// Renders the whole volume; the image covers the whole frame (the sheet grid). setup.termination is not used.
LocalImage ReferenceSplatting(const Volume& volume, const FrameSetup& setup);

// The picture of a frame.
LocalImage ReferencePicture(const LocalImage& frame, const FrameSetup& setup);

// The gradient of the stored samples at a voxel, in units of the samples by physical distance.
Vec3 ReferenceGradient(const Volume& volume, const Index3& voxel);

}  // namespace slabstream::testing
