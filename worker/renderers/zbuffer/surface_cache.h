// SurfaceCache: the surfaces of a slab. The Z-buffer keeps them between frames until the transfer function makes other voxels opaque.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "worker/renderers/slab_data.h"
#include "worker/renderers/zbuffer/surface.h"

namespace slabstream {

class SurfaceCache : public SlabCache {
 public:
  // Faces of the opaque voxels of `box`: those with at least half of the largest opacity in the volume's range of values. Valid until the
  // next call.
  const Surface& OpaqueSurface(SlabData& slab, const FrameSetup& setup, const Box& box);

  std::size_t bytes() const override;

 private:
  static constexpr std::size_t kKeptBoxes = 16;  // several boxes may share a slab
  BinSelection opaque_bins_;
  std::deque<std::pair<Box, Surface>> surfaces_;  // most recently used first
};

}  // namespace slabstream
