// The Z-buffer pipeline: each opaque voxel is its cell, the box [q - 0.5, q + 0.5) round its centre; the nearest cell along a pixel's ray
// is seen, and only what is seen is shaded (deferred Phong). There are no holes at any zoom, and the silhouette is exact. The same bits for
// every partition, machine and thread count: all is a function of pixel and voxel, ties of depth go to the lower voxel index (NearerDepth).
#pragma once

#include "worker/render/pipeline.h"

namespace slabstream {

class ZBufferRenderer : public Renderer {
 public:
  Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const std::atomic<bool>& cancelled,
                            RankReport& report) override;
};

}  // namespace slabstream
