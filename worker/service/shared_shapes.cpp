#include "worker/service/shared_shapes.h"

#include <vector>

namespace slabstream {

std::shared_ptr<SharedShapes> SharedShapes::Of(const FrameSetup& setup) {
  static std::mutex mutex;
  static std::vector<std::weak_ptr<SharedShapes>> all;
  const std::lock_guard lock(mutex);
  std::erase_if(all, [](const auto& each) { return each.expired(); });
  for (const std::weak_ptr<SharedShapes>& each : all) {
    if (std::shared_ptr<SharedShapes> shared = each.lock(); shared != nullptr && shared->setup_ == setup) return shared;
  }
  const auto shared = std::make_shared<SharedShapes>(setup);
  all.push_back(shared);
  return shared;
}

Result<std::shared_ptr<const FrameShapes>> SharedShapes::Make(std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                              const std::shared_ptr<const FrameLight>& light) {
  const std::lock_guard lock(mutex_);
  if (!shapes_) shapes_ = MakeFrameShapes(setup_, bytes, light, tiles_);
  return *shapes_;
}

void SharedShapes::Add(const ShapeTiles& message, const Bytes& payload) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i < message.tiles.size(); ++i) {
    tiles_->Add(message.tiles[i], payload.Part(begin, message.bytes[i]));
    begin += message.bytes[i];
  }
}

}  // namespace slabstream
