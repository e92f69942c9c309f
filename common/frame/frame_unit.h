// The unit of lengths in a frame. Renderers work in single precision, which holds neither the squares of 1e22 nor those of 1e-22. So a
// volume far from the size of a unit is drawn in another one, in which it is some hundred units large: a volume of 1e36 or 1e-36 then looks
// like the same one of 1. The unit is a power of two, so no bit of a mantissa changes, and most volumes keep the unit of their world.
#pragma once

#include "common/classification/transfer_function.h"
#include "common/view/camera.h"
#include "common/view/clip.h"
#include "common/volume/volume.h"

namespace slabstream {

// In the unit of the volume's world.
double FrameUnitOf(const VolumeGeometry& geometry);

// The same things in a unit of this length. In a transfer function, only slopes have lengths.
VolumeGeometry InUnit(VolumeGeometry geometry, double unit);
ViewParameters InUnit(ViewParameters view, double unit);
ClipRegion InUnit(ClipRegion clip, double unit);
TransferFunction InUnit(TransferFunction transfer, double unit);

// InvalidArgument naming field, value and limit: lengths that cannot be calculated with, or a volume that is too long for its voxels.
Status CheckDrawable(const VolumeGeometry& geometry);
// InvalidArgument: so far from the volume that there are no numbers for it.
Status CheckDrawable(const Camera& camera);

}  // namespace slabstream
