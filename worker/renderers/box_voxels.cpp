#include "worker/renderers/box_voxels.h"

namespace slabstream {

BoxVoxels::Samples BoxVoxels::Block() {
  const std::lock_guard lock(mutex_);
  if (samples_.block == nullptr) {
    const VoxelBricks bricks = samples_.view();
    VoxelBlock block = MakeVoxelBlock(bricks.box(), bricks.type());
    bricks.Read(block.box, 0, block.bytes);
    samples_ = {std::make_shared<const VoxelBlock>(std::move(block)), nullptr, nullptr};
  }
  return samples_;
}

std::size_t BoxVoxels::bytes() const {
  const Samples stored = samples();
  std::size_t total = stored.block != nullptr    ? stored.block->bytes.capacity()
                      : stored.bricks != nullptr ? stored.bricks->bytes()
                                                 : stored.padded->bytes();
  return total + (cells_ != nullptr ? cells_->bytes() : 0);
}

}  // namespace slabstream
