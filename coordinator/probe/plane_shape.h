// PlaneShape: a plane through a volume as a shape that shows the volume's values (PlaneValues).
#pragma once

#include <functional>

#include "common/base/status.h"
#include "common/shapes/shape.h"
#include "common/view/clip.h"
#include "common/volume/volume.h"

namespace slabstream {

// The voxels of a box inside the volume, which is not empty. Any thread.
using ReadPlaneBox = std::function<Result<VoxelBlock>(const Box&)>;

// The part of the slab's middle plane that lies in the volume, in its world: a convex polygon, none if the plane misses it. It has a sample
// for each voxel that the plane crosses, or twice as many a side if it is not along the axes of the voxels, but at most kMaxPlaneSide; they
// are trilinear between voxels. A sample near a value that is not finite is none. The slab is one of the volume
// (CheckSlice is ok). Errors of `read`. Uses the threads of the caller's task arena.
Result<Shape> PlaneShape(const ClipSlab& slab, const VolumeDescription& description, const ReadPlaneBox& read);

}  // namespace slabstream
