#include "worker/renderers/zbuffer/surface_cache.h"

#include <utility>
#include <vector>

namespace slabstream {

const Surface& SurfaceCache::Of(SlabData& slab, const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = slab.Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != opaque_bins_) {
    surfaces_.Clear();
    opaque_bins_ = std::move(bins);
  }
  if (const Surface* kept = surfaces_.Find(box)) return *kept;
  std::vector<KnownSurface> known;
  for (const auto& [other, surface] : surfaces_.entries()) {
    if (!Intersection(other, box).empty()) known.push_back({other, &surface});
  }
  const BrickRanges& ranges = slab.ranges();  // first: bricks are read faster than the block
  const VoxelBlock& voxels = slab.voxels();
  return surfaces_.Add(box, FindSurface(voxels, ranges, table, opaque_bins_, setup.description.geometry.spacing, box, known),
                       voxels.box.voxel_count());
}

std::size_t SurfaceCache::bytes() const {
  std::size_t total = 0;
  for (const auto& [box, surface] : surfaces_.entries()) total += surface.bytes();
  return total;
}

}  // namespace slabstream
