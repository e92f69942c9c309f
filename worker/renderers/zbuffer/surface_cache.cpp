#include "worker/renderers/zbuffer/surface_cache.h"

#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {

void SurfaceCache::ShowLabels(const SlabData& slab, const LayerLooks& looks) {
  std::optional<ShownLabels> labels;
  if (looks.labels) {
    CHECK(slab.layers().labels.has_value()) << "labels are shown that the slab does not have";
    labels = {&*slab.layers().labels, UsesOf(*looks.labels)};
    if (!label_ranges_) label_ranges_.emplace(*slab.layers().labels);
  }
  if (labels.has_value() == labels_.has_value() && (!labels || labels->uses == labels_->uses)) return;
  surfaces_.Clear();
  labels_ = std::move(labels);
}

const Surface& SurfaceCache::Of(SlabData& slab, const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = slab.Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != opaque_bins_) {
    surfaces_.Clear();
    opaque_bins_ = std::move(bins);
  }
  ShowLabels(slab, setup.looks);
  if (const Surface* kept = surfaces_.Find(box)) return *kept;
  std::vector<KnownSurface> known;
  for (const auto& [other, surface] : surfaces_.entries()) {
    if (!Intersection(other, box).empty()) known.push_back({other, &surface});
  }
  const BrickRanges& ranges = slab.ranges();  // first: bricks are read faster than the block
  const VoxelBlock& voxels = slab.voxels();
  const OpaqueVoxels opaque = {table, opaque_bins_, ranges, labels(), label_ranges_ ? &*label_ranges_ : nullptr};
  return surfaces_.Add(box, FindSurface(voxels, opaque, setup.description.geometry.spacing, box, known), voxels.box.voxel_count());
}

std::size_t SurfaceCache::bytes() const {
  std::size_t total = label_ranges_ ? label_ranges_->bytes() : 0;
  for (const auto& [box, surface] : surfaces_.entries()) total += surface.bytes();
  return total;
}

}  // namespace slabstream
