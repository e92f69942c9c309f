#include <algorithm>

#include "worker/render/derived.h"

namespace slabstream {

SlabData::SlabData(VoxelBlock voxels) : voxels_(std::move(voxels)), derived_(std::make_unique<Derived>(voxels_)) {}
SlabData::~SlabData() = default;

std::size_t SlabData::bytes() const { return voxels_.bytes.capacity() + derived_->bytes(); }

const BrickRanges& SlabData::Derived::Bricks() {
  if (!bricks_) bricks_.emplace(voxels_);
  return *bricks_;
}

const ClassificationTable& SlabData::Derived::Classification(const FrameSetup& setup) {
  // A slab's description never changes: it is that of its dataset.
  auto key = std::pair(setup.transfer, setup.range);
  if (classified_ != key) {
    table_ = Classify(setup.transfer, setup.description, setup.range);
    classified_ = std::move(key);
  }
  return table_;
}

const OccupiedCells& SlabData::Derived::Occupied(const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != occupied_bins_) {
    occupied_.clear();
    occupied_bins_ = std::move(bins);
  }
  const Axis axis = setup.camera.traversal_axis;
  const auto kept = std::ranges::find_if(occupied_, [&](const auto& entry) { return entry.first == box && entry.second.axes.c == axis; });
  if (kept != occupied_.end()) {
    std::rotate(occupied_.begin(), kept, kept + 1);
  } else {
    if (occupied_.size() >= kKeptAxes) occupied_.pop_back();
    occupied_.emplace_front(box,
                            FindOccupiedCells(voxels_, Bricks(), table, occupied_bins_, setup.description.geometry.spacing, axis, box));
  }
  return occupied_.front().second;
}

const std::vector<SurfaceVoxel>& SlabData::Derived::Surface(const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = Classification(setup);
  BinSelection bins = SelectBins(table, 0.5F * MaxOpacity(table, setup.description, setup.range));
  if (bins != opaque_bins_ || !surface_ || surface_->first != box) {
    opaque_bins_ = std::move(bins);
    surface_.emplace(box, FindSurfaceVoxels(voxels_, Bricks(), table, opaque_bins_, box));
  }
  return surface_->second;
}

std::size_t SlabData::Derived::bytes() const {
  std::size_t total = bricks_ ? bricks_->bytes() : 0;
  total += table_.opacity.capacity() * sizeof(float) + table_.color.capacity() * sizeof(Rgb);
  for (const auto& [box, cells] : occupied_) total += cells.bytes();
  if (surface_) total += surface_->second.capacity() * sizeof(SurfaceVoxel);
  return total;
}

}  // namespace slabstream
