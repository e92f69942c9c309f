#include "worker/renderers/box_data.h"

#include "common/renderers/renderer_kind.h"

namespace slabstream {

BoxVoxels::Samples BoxVoxels::Block() {
  const std::lock_guard lock(mutex_);
  if (samples_.block == nullptr) {
    samples_ = {std::make_shared<const VoxelBlock>(samples_.view().Block()), nullptr, nullptr, nullptr};
  }
  return samples_;
}

std::size_t BoxVoxels::bytes() const {
  const Samples stored = samples();
  std::size_t total = stored.block != nullptr    ? stored.block->bytes.capacity()
                      : stored.bricks != nullptr ? stored.bricks->bytes()
                      : stored.padded != nullptr ? stored.padded->bytes()
                                                 : 0;
  return total + (cells_ != nullptr ? cells_->bytes() : 0);
}

const VoxelBlock& BoxData::voxels() const {
  if (samples_.block == nullptr) {
    samples_ = {};  // first, so that others' bricks may go
    samples_ = voxels_->Block();
  }
  return *samples_.block;
}

const BrickRanges& BoxData::ranges() {
  if (!ranges_) ranges_.emplace(bricks());
  return *ranges_;
}

const ClassificationTable& BoxData::Classification(const FrameSetup& setup) {
  // A padded box's description never changes: it is its dataset's.
  auto key = std::tuple(setup.renderer, setup.transfer, setup.range);
  if (classified_ != key) {
    table_ = setup.renderer->Table(setup.transfer, setup.description, setup.range);
    classified_ = std::move(key);
  }
  return table_;
}

std::size_t BoxData::derived_bytes() const {
  std::size_t total = ranges_ ? ranges_->bytes() : 0;
  total += table_.opacity.capacity() * sizeof(float) + table_.color.capacity() * sizeof(Rgb);
  for (const auto& [type, cache] : caches_) total += cache->bytes();
  return total;
}

}  // namespace slabstream
