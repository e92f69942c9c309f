#include "worker/renderers/zbuffer/surface_cache.h"

#include <utility>
#include <vector>

#include "common/base/check.h"

namespace slabstream {

void SurfaceCache::ShowLabels(const BoxData& data, const LayerLooks& looks) {
  std::optional<ShownLabels> labels;
  if (looks.labels) {
    CHECK(data.layers().labels.has_value()) << "labels are shown that the data does not have";
    labels = {&*data.layers().labels, UsesOf(*looks.labels)};
    if (!label_ranges_) label_ranges_.emplace(*data.layers().labels);
  }
  if (labels.has_value() == labels_.has_value() && (!labels || labels->uses == labels_->uses)) return;
  surfaces_.Clear();
  labels_ = std::move(labels);
}

const Surface& SurfaceCache::Of(BoxData& data, const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = data.Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != opaque_bins_) {
    surfaces_.Clear();
    opaque_bins_ = std::move(bins);
  }
  ShowLabels(data, setup.looks);
  if (const Surface* kept = surfaces_.Find(box)) return *kept;
  std::vector<KnownSurface> known;
  for (const auto& other : surfaces_.entries()) {
    if (!Intersection(other.key, box).empty()) known.push_back({other.key, &other.value});
  }
  const BrickRanges& ranges = data.ranges();  // first: bricks are read faster than the block
  const VoxelBlock& voxels = data.voxels();
  const OpaqueVoxels opaque = {table, opaque_bins_, ranges, labels(), label_ranges_ ? &*label_ranges_ : nullptr};
  return KeepBox(surfaces_, box, FindSurface(voxels, opaque, setup.description.geometry.spacing, box, known), voxels.box.voxel_count());
}

std::size_t SurfaceCache::bytes() const {
  std::size_t total = label_ranges_ ? label_ranges_->bytes() : 0;
  for (const auto& surface : surfaces_.entries()) total += surface.value.bytes();
  return total;
}

}  // namespace slabstream
