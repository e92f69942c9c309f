// ShownZones: the parts of a large level that a picture shows. Boxes are made of these parts alone. So what is read, and the number of
// boxes, follow from what the picture shows, and not from the size of the level.
//
// Parts are zones of whole blocks of the source. They are found from coarse to fine: what lies outside the picture, or is clipped away, is
// not looked at more closely.
#pragma once

#include <memory>

#include "common/frame/frame_setup.h"
#include "common/planning/level_map.h"

namespace slabstream {

// Pure. A map of one level. Null: the frame's volume is not read in parts, has coarser levels beside it, or the picture shows more than
// half of it; its boxes are then those of all views.
std::shared_ptr<const LevelMap> ShownZones(const FrameSetup& setup);

}  // namespace slabstream
