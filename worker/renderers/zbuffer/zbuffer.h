// The Z-buffer pipeline: each opaque voxel is its cell, the box [q - 0.5, q + 0.5) round its centre, of which the open faces are drawn; the
// nearest along a pixel's ray is seen, and only what is seen is shaded (deferred Phong). There are no holes at any zoom. The same bits for
// every partition, machine and thread count: all is a function of pixel and face, ties of depth go to the lower voxel index.
//
//   1. bricks of the surface are placed on the screen and sorted, nearest first
//   2. the image is cut into bands of rows, one task each: nobody else touches its pixels
//   3. a band draws its bricks (draw_faces.h), but those behind what is drawn already, then shades its pixels (shade_faces.h)
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
  // More bands balance the load better; bricks on the border of two are drawn by both.
  static constexpr int kBandsPerThread = 4;

  tbb::enumerable_thread_specific<AlignedVector<std::uint64_t>> keys_;  // of a band; kept from frame to frame
};

namespace zbuffer {
std::unique_ptr<Renderer> MakePixelHalf();
}

}  // namespace slabstream
