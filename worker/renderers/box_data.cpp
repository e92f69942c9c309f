#include "worker/renderers/box_data.h"

#include "common/renderers/renderer_kind.h"

namespace slabstream {

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
