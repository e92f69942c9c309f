// The corners of what clipping leaves of a box.
#pragma once

#include <vector>

#include "common/view/clip.h"
#include "common/volume/volume.h"

namespace slabstream {

// The corners of the convex part of the voxels of `box` that `region` leaves, in data space, in no order, some perhaps more than once.
// None: nothing is left. The region is kept (ClipMode::kKeep), and the box is not empty.
std::vector<Vec3> CornersOf(const ClipRegion& region, const Box& box);

}  // namespace slabstream
