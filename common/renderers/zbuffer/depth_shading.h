// Shading in image space: Phong (1975) with normals from the depths of neighbouring pixels (Gordon and Reynolds, Image
// space shading of 3-dimensional objects, 1985).
//
// A pixel and a neighbour are two points of the surface. From the neighbours before and behind along a row, and along a
// column, at the distance of about two voxels, two tangents follow; their cross product is the normal. The neighbour
// that is nearer in depth counts for more, so that the edge of one object in front of another is lit by the object's
// own side.
#pragma once

#include "common/frame/frame_setup.h"
#include "common/image/local_image.h"

namespace slabstream {

// `frame`: the whole frame (format kDepth, no row spans), with the colours of the transfer function. The result has the same bounds, depths
// and alpha. A pixel without a neighbour along a row or a column is lit like material without a gradient. Runs on the threads of the
// calling task arena; the bits do not depend on them.
LocalImage ShadeByDepth(const LocalImage& frame, const FrameSetup& setup);

}  // namespace slabstream
