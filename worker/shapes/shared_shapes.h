// The shapes of the latest frames, in the whole process: the workers and the boxes of a frame share them.
#pragma once

#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// As MakeFrameShapes. Any thread.
Result<std::shared_ptr<const FrameShapes>> SharedFrameShapes(const FrameSetup& setup,
                                                             std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                             const std::shared_ptr<const FrameLight>& light);

}  // namespace slabstream
