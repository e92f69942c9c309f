#include "worker/renderers/splat/splat_cache.h"

#include <algorithm>

namespace slabstream {

const CellBeams& SplatCache::Beams(SlabData& slab, const FrameSetup& setup, Axis u) {
  if (!along_x_) {
    const ClassificationTable& table = slab.Classification(setup);
    along_x_ = FindCellBeams(slab.bricks(), slab.ranges(), table, occupied_bins_, setup.description.geometry.spacing);
  }
  if (u == Axis::kX) return *along_x_;
  if (!along_y_) along_y_ = TurnCellBeams(*along_x_);
  return *along_y_;
}

const OccupiedCells& SplatCache::Occupied(SlabData& slab, const FrameSetup& setup, const Box& box) {
  if (BinSelection bins = SelectBins(slab.Classification(setup), 0); bins != occupied_bins_) {
    occupied_.clear();
    along_x_.reset();
    along_y_.reset();
    occupied_bins_ = std::move(bins);
  }
  const Axis axis = setup.camera.traversal_axis;
  const auto kept = std::ranges::find_if(occupied_, [&](const auto& entry) { return entry.first == box && entry.second.axes.c == axis; });
  if (kept != occupied_.end()) {
    std::rotate(occupied_.begin(), kept, kept + 1);
  } else {
    if (occupied_.size() >= kKeptViews) occupied_.pop_back();
    occupied_.emplace_front(box, CellsOf(Beams(slab, setup, AxesOf(axis).u), axis, box));
  }
  return occupied_.front().second;
}

std::size_t SplatCache::bytes() const { return (along_x_ ? along_x_->bytes() : 0) + (along_y_ ? along_y_->bytes() : 0); }

}  // namespace slabstream
