// The last step of a frame: from what workers rendered and combined to the picture that a client gets.
#pragma once

#include "common/image/local_image.h"
#include "common/planning/frame_plan.h"

namespace slabstream {

// Splatting: the frame's sheet grid is resampled; Z-buffer: supersampling is resolved. Bounds of the result are in pixels of the picture.
// Called within a task arena, as Renderer::Render is.
LocalImage FinishPicture(const LocalImage& frame, const FrameSetup& setup);

// True if that would be a copy of the frame.
bool FrameIsPicture(const FrameSetup& setup);

}  // namespace slabstream
