#include <algorithm>
#include <functional>

#include "worker/render/derived.h"

namespace slabstream {

SlabData::SlabData(VoxelBlock voxels) : block_(std::move(voxels)), derived_(std::make_unique<Derived>(*this)) {}
SlabData::SlabData(BrickedVoxels voxels) : bricks_(std::move(voxels)), derived_(std::make_unique<Derived>(*this)) {}
SlabData::~SlabData() = default;

const VoxelBlock& SlabData::voxels() const {
  if (bricks_) {
    block_ = MakeVoxelBlock(bricks_->grid().box, bricks_->type());
    bricks().Read(block_.box, 0, block_.bytes);
    bricks_.reset();
  }
  return block_;
}

std::size_t SlabData::bytes() const { return block_.bytes.capacity() + (bricks_ ? bricks_->bytes() : 0) + derived_->bytes(); }

const BrickRanges& SlabData::Derived::Bricks() {
  if (!bricks_) bricks_.emplace(slab_.bricks());
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

const CellBeams& SlabData::Derived::Beams(const FrameSetup& setup, Axis u) {
  if (!along_x_) {
    along_x_ = FindCellBeams(slab_.bricks(), Bricks(), table_, occupied_bins_, setup.description.geometry.spacing);
  }
  if (u == Axis::kX) return *along_x_;
  if (!along_y_) along_y_ = TurnCellBeams(*along_x_);
  return *along_y_;
}

const OccupiedCells& SlabData::Derived::Occupied(const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = Classification(setup);
  if (BinSelection bins = SelectBins(table, 0); bins != occupied_bins_) {
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
    occupied_.emplace_front(box, CellsOf(Beams(setup, AxesOf(axis).u), axis, box));
  }
  return occupied_.front().second;
}

const Surface& SlabData::Derived::OpaqueSurface(const FrameSetup& setup, const Box& box) {
  const ClassificationTable& table = Classification(setup);
  BinSelection bins = SelectBins(table, 0.5F * MaxOpacity(table, setup.description, setup.range));
  if (bins != opaque_bins_ || !surface_ || surface_->first != box) {
    opaque_bins_ = std::move(bins);
    const BrickRanges& bricks = Bricks();  // first: bricks are read faster than the block
    surface_.emplace(box, FindSurface(slab_.voxels(), bricks, table, opaque_bins_, setup.description.geometry.spacing, box));
  }
  return surface_->second;
}

std::size_t SlabData::Derived::bytes() const {
  std::size_t total = bricks_ ? bricks_->bytes() : 0;
  total += table_.opacity.capacity() * sizeof(float) + table_.color.capacity() * sizeof(Rgb);
  for (const auto& beams : {std::cref(along_x_), std::cref(along_y_)}) total += beams.get() ? beams.get()->bytes() : 0;
  if (surface_) total += surface_->second.bytes();
  return total;
}

}  // namespace slabstream
