// The splatting pipeline (Westover 1990, one sheet a slice): transform, shade, splat, composite. docs/rendering.md defines what it
// computes.
#pragma once

#include "worker/renderers/renderer.h"

namespace slabstream {

class SplattingRenderer : public Renderer {
 public:
  Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const OcclusionMask& hidden,
                            const std::atomic<bool>& cancelled, RankReport& report) override;
};

namespace splat {
std::unique_ptr<Renderer> MakePixelHalf();
}

}  // namespace slabstream
