// SurfaceCache: the surfaces of a slab's boxes. The Z-buffer keeps them between frames until the transfer function makes other voxels
// opaque.
#pragma once

#include <cstddef>

#include "worker/renderers/recent_boxes.h"
#include "worker/renderers/slab_data.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {

class SurfaceCache : public SlabCache {
 public:
  // Faces of the opaque voxels of `box`, which lies in the slab. Valid until the next call.
  const Surface& Of(SlabData& slab, const FrameSetup& setup, const Box& box);
  // Of the voxels that were opaque at the last call.
  const BinSelection& opaque_bins() const { return opaque_bins_; }

  std::size_t bytes() const override;

 private:
  BinSelection opaque_bins_;
  RecentBoxes<Surface> surfaces_;
};

}  // namespace slabstream
