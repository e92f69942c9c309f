#include "worker/renderers/zbuffer/surface_cache.h"

#include <utility>
#include <vector>

namespace slabstream {

Result<const Surface*> SurfaceCache::Of(BoxData& data, const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = data.Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != opaque_bins_) {
    surfaces_.Clear();
    opaque_bins_ = std::move(bins);
  }
  bool others_are_opaque = false;
  const Result<const BoxLabels*> labels = labels_.Of(data, setup, others_are_opaque);
  if (!labels.ok()) return labels.status();
  if (others_are_opaque) surfaces_.Clear();
  if (const Surface* kept = surfaces_.Find(box)) return kept;
  std::vector<KnownSurface> known;
  for (const auto& other : surfaces_.entries()) {
    if (!Intersection(other.key, box).empty()) known.push_back({other.key, &other.value});
  }
  const BrickRanges& ranges = data.ranges();  // first: bricks are read faster than the block
  const VoxelBlock& voxels = data.voxels();
  const OpaqueVoxels opaque = {table, opaque_bins_, ranges, *labels};
  return &KeepBox(surfaces_, box, FindSurface(voxels, opaque, setup.description.geometry.spacing, box, known), voxels.box.voxel_count());
}

std::size_t SurfaceCache::bytes() const {
  std::size_t total = labels_.bytes();
  for (const auto& surface : surfaces_.entries()) total += surface.value.bytes();
  return total;
}

}  // namespace slabstream
