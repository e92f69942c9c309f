// Framing: the view that shows all that a renderer may draw (`fit`).
#pragma once

#include <optional>
#include <vector>

#include "common/frame/frame_request.h"
#include "common/shapes/packed_shape.h"
#include "common/view/ball.h"
#include "common/view/clip.h"
#include "common/volume/affine_map.h"
#include "common/volume/volume.h"

namespace slabstream {

// What a picture frames of what shows at `places`, boxes of data space (BrickVisibility::VisibleBricks, BoxAround): a ball round them, so
// that the scale stays while the view turns. A slab is flat and faces the view, so its picture frames the cut instead: what `clip` leaves
// of the places fills the picture's width or its height. None: there are no places. `request.view` has its angles (WithDefaults).
std::optional<Ball> FramedBall(const FrameRequest& request, const std::vector<Box>& places, const ClipRegion& clip,
                               const VolumeGeometry& geometry);

// From the volume's world to its data space.
AffineMap FromWorld(const VolumeGeometry& geometry);
// Where a shape lies in the volume's data space: its bounds, at most kFarthestShape voxels from the first voxel.
inline constexpr double kFarthestShape = 1 << 24;
Box BoxAround(const ShapeInfo& shape, const VolumeGeometry& geometry);

}  // namespace slabstream
