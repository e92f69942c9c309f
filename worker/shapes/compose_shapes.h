// ComposeShapes: the shapes of a frame and what its boxes have made of the volume become one image.
#pragma once

#include "common/frame/frame_setup.h"
#include "common/image/local_image.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// The accumulated frame, or a share of it, with its shapes; pixels outside `pixels` stay as they are. All pixels of `frame` are stored.
//   kRgba    boxes have composited the fragments in the volume but the opaque ones; those in front of it go over the frame, all others
//            under it
//   kDepth   fragments nearer than a pixel's surface go over it
LocalImage ComposeShapes(const LocalImage& frame, PixelRange pixels, const FrameSetup& setup, const FrameShapes& shapes);

// Of other formats: the picture that RendererKind::Finish made goes over the shapes.
LocalImage PictureOverShapes(const LocalImage& picture, const FrameSetup& setup, const FrameShapes& shapes);

}  // namespace slabstream
