// Framing: the view that shows all that a renderer may draw (`fit`).
#pragma once

#include <vector>

#include "common/frame/frame_request.h"
#include "common/view/clip.h"
#include "common/volume/volume.h"

namespace slabstream {

// The view of `request` moved to the middle of `bricks` (BrickVisibility::VisibleBricks; none: as it is), and magnified so that they fill
// the picture at zoom 1: the ball round them touches its shorter side, so that the scale stays while the view turns. A slab is flat and
// faces the view, so its picture frames the cut instead: what `clip` leaves of the bricks fills the picture's width or its height.
ViewParameters FramedView(const FrameRequest& request, const std::vector<Box>& bricks, const ClipRegion& clip,
                          const VolumeGeometry& geometry);

}  // namespace slabstream
