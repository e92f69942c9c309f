// Extinction: how much light the matter of a volume takes, on the grid of its light volume (common/volume/light_volume.h).
//
// Opacity is no linear function of the value, so the mean value of a block of voxels does not tell its opacity. What is classified is the
// interpolated light volume: between the centre of a voxel and its border, halfway to the least and to the greatest of its six neighbours,
// values run evenly, and the voxel has the mean extinction of these values. So the extinction along a straight ramp is exact, and no
// narrow peak of a transfer function is missed between two voxels. Structures thinner than a voxel of the light volume count by their
// mean value.
//
// Isosurfaces take their opacity once where the value passes theirs. Matter that is clipped away takes nothing. Regions of a
// two-dimensional transfer function count with the slope in the light volume, which is coarser. Layers do not count, nor does gradient
// opacity without regions.
#pragma once

#include "common/frame/frame_setup.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

struct Extinction {
  Index3 size;
  Vec3 spacing;                 // distances of centres, in the unit of the world
  UnwrittenVector<float> each;  // by voxel, x fastest: -ln of the transmittance of a unit of length, finite, >= 0
};

// `values`: the whole light volume of the setup (setup.light). Parallel; the result is the same for any number of threads and any
// instruction set.
Extinction ExtinctionOf(const VoxelBlock& values, const FrameSetup& setup);

}  // namespace slabstream
