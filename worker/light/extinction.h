// Extinction: how much light the matter of all fields that show takes, on the grid of the volume's light volume
// (common/volume/light_volume.h).
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
//
// Each field is classified on its own light volume. On another grid than the volume's its extinction, interpolated linearly, has its mean
// in each voxel. Then fields are blended as in a sample of the picture (docs/rendering.md).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/frame/frame_setup.h"
#include "common/memory/pooled_vector.h"

namespace slabstream {

inline constexpr double kMostOpacity = 0.999;  // of a voxel length, or of a surface: more is not seen in a shadow

struct Extinction {
  Index3 size;
  Vec3 spacing;                 // distances of centres, in the unit of the world
  UnwrittenVector<float> each;  // by voxel, x fastest: -ln of the transmittance of a unit of length, finite, >= 0
};

// The whole light volume with this number of LightVolumesOf the setup. Each is asked for at most once, one after the other.
using LightValues = std::function<VoxelBlock(std::size_t)>;

// How the volume looks, and each other field: by LightVolumesOf.
std::vector<FieldLook> LooksInLight(const FrameSetup& setup);

// Parallel; the result is the same for any number of threads and any instruction set.
Extinction ExtinctionOf(const LightValues& values, const FrameSetup& setup);

}  // namespace slabstream
