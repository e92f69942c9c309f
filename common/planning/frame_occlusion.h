// Occlusion masks of a frame: whether it uses them at all, and whether a mask fits it.
//
// Early termination across groups: the display worker accumulates groups front to back, finds the tiles that transmit at most the frame's
// termination threshold (FindHiddenTiles) and sends them to the coordinator with GroupDone; the coordinator puts the newest mask into the
// assignments of groups that lie behind it; their workers skip what it hides (Renderer::Render), and do not fetch the voxels of boxes that
// are hidden as a whole.
#pragma once

#include "common/frame/frame_setup.h"
#include "common/image/occlusion_mask.h"

namespace slabstream {

// True for images that blend front to back with a termination threshold. In other formats no pixel is final before all groups are in.
inline bool UsesOcclusion(const FrameSetup& setup) { return setup.format == PixelFormat::kRgba && setup.termination > 0; }

// InvalidArgument: a mask that is not empty in a frame that uses none, or whose numbers of tiles are not the frame's.
Status CheckFits(const OcclusionMask& mask, const FrameSetup& setup);

// Whether `mask`, which fits the frame, hides all that `box` could show, so that its voxels need not be fetched. An empty mask hides
// nothing.
bool HidesBox(const OcclusionMask& mask, const Box& box, const FrameSetup& setup);

}  // namespace slabstream
