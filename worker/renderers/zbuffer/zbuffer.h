// The Z-buffer pipeline. Each opaque voxel is its cell, the box [q - 0.5, q + 0.5) round its centre, and its open faces are drawn. The
// nearest face along a pixel's ray is visible, and only visible faces are shaded (deferred Phong). There are no holes at any zoom. The
// picture has the same bits for every partition, machine and thread count: it depends only on pixels and faces, and ties of depth go to the
// lower voxel index.
//
//   1. place the bricks of the surface on the screen and sort them, nearest first
//   2. cut the image into bands of rows, one task each: no other task touches a band's pixels
//   3. each band draws its bricks (draw_faces.h), except those behind what is already drawn, then shades its pixels (shade_faces.h)
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>

#include "worker/renderers/renderer.h"

namespace slabstream {

class ZBufferRenderer : public Renderer {
 public:
  Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const OcclusionMask& hidden,
                            const std::atomic<bool>& cancelled, RankReport& report) override;

 private:
  // More bands balance the load better, but bricks on the border of two bands are drawn by both.
  static constexpr int kBandsPerThread = 4;

  tbb::enumerable_thread_specific<AlignedVector<std::uint64_t>> keys_;  // of a band; kept from frame to frame
};

namespace zbuffer {
std::unique_ptr<Renderer> MakePixelHalf();
}

}  // namespace slabstream
