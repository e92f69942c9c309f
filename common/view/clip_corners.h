// The corners of what clipping leaves of a box.
#pragma once

#include <vector>

#include "common/view/clip.h"
#include "common/volume/volume.h"

namespace slabstream {

// What `region`, which is kept (ClipMode::kKeep), leaves of the voxels of `box` (not empty) is convex: its corners, in data space, in no
// order, some perhaps more than once. None: nothing is left.
std::vector<Vec3> CornersOf(const ClipRegion& region, const Box& box);

}  // namespace slabstream
