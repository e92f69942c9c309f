// What a frame has to do with occlusion masks: whether it uses them at all, and whether a mask is one of this frame.
//
// Early termination across groups, the whole way: the display worker accumulates groups front to back, finds the tiles that transmit at
// most the frame's termination threshold (FindHiddenTiles) and tells the coordinator with GroupDone; the coordinator puts the newest mask
// into the assignments of groups that lie behind it; their workers leave out what it hides (Renderer::Render), and do not fetch the voxels
// of boxes that are hidden as a whole.
#pragma once

#include "common/frame/frame_setup.h"
#include "common/image/occlusion_mask.h"

namespace slabstream {

// Images that blend front to back, with a termination threshold. In other formats no pixel is final before all groups are in.
inline bool UsesOcclusion(const FrameSetup& setup) { return setup.format == PixelFormat::kRgba && setup.termination > 0; }

// InvalidArgument: a mask that is not empty in a frame that uses none, or with other numbers of tiles than the frame has.
Status CheckFits(const OcclusionMask& mask, const FrameSetup& setup);

// Whether `mask`, which fits the frame, hides all that `box` could show, so that its voxels need not even be fetched. No mask hides
// nothing.
bool HidesBox(const OcclusionMask& mask, const Box& box, const FrameSetup& setup);

}  // namespace slabstream
