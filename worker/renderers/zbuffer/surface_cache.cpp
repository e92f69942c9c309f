#include "worker/renderers/zbuffer/surface_cache.h"

#include <algorithm>

#include "common/renderers/zbuffer/least_opaque.h"

namespace slabstream {

const Surface& SurfaceCache::OpaqueSurface(SlabData& slab, const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = slab.Classification(setup);
  if (BinSelection bins = SelectBins(table, zbuffer::LeastOpaque(table, setup.description, setup.range)); bins != opaque_bins_) {
    surfaces_.clear();
    opaque_bins_ = std::move(bins);
  }
  const auto kept = std::ranges::find(surfaces_, box, &std::pair<Box, Surface>::first);
  if (kept != surfaces_.end()) {
    std::rotate(surfaces_.begin(), kept, kept + 1);
  } else {
    if (surfaces_.size() >= kKeptBoxes) surfaces_.pop_back();
    const BrickRanges& ranges = slab.ranges();  // first: bricks are read faster than the block
    surfaces_.emplace_front(box, FindSurface(slab.voxels(), ranges, table, opaque_bins_, setup.description.geometry.spacing, box));
  }
  return surfaces_.front().second;
}

std::size_t SurfaceCache::bytes() const {
  std::size_t total = 0;
  for (const auto& [box, surface] : surfaces_) total += surface.bytes();
  return total;
}

}  // namespace slabstream
