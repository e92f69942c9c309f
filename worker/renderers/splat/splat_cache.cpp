#include "worker/renderers/splat/splat_cache.h"

#include <utility>

namespace slabstream {

const VoxelBeams& SplatCache::Beams(BoxData& data, const FrameSetup& setup, Axis u) {
  if (!along_x_) {
    const ClassificationTable& table = data.Classification(setup);
    along_x_ = FindVoxelBeams(data.bricks(), data.ranges(), table, occupied_bins_, setup.description.geometry.spacing);
  }
  if (u == Axis::kX) return *along_x_;
  if (!along_y_) {
    if (along_x_->to_make != nullptr) along_x_->to_make->NeedAll();
    along_y_ = TurnVoxelBeams(*along_x_);
  }
  return *along_y_;
}

const OccupiedVoxels& SplatCache::Occupied(BoxData& data, const FrameSetup& setup, const Box& box) {
  if (BinSelection bins = SelectBins(data.Classification(setup), 0); bins != occupied_bins_) {
    for (auto& of_axis : occupied_) of_axis.Clear();
    along_x_.reset();
    along_y_.reset();
    occupied_bins_ = std::move(bins);
  }
  if (along_x_ && along_x_->to_make != nullptr) along_x_->to_make->SetVoxels(data.bricks());
  const Axis axis = setup.camera.traversal_axis;
  auto& of_axis = occupied_[std::size_t(axis)];
  if (const OccupiedVoxels* kept = of_axis.Find(box)) return *kept;
  return KeepBox(of_axis, box, VoxelsOf(Beams(data, setup, AxesOf(axis).u), axis, box), data.bricks().box().voxel_count());
}

std::size_t SplatCache::bytes() const { return (along_x_ ? along_x_->bytes() : 0) + (along_y_ ? along_y_->bytes() : 0); }

}  // namespace slabstream
