// SharedShapes: the shapes of a frame in the whole process. The workers and the boxes of a frame share them, and so do frames of equal
// setups. Tiles that came from other workers are not drawn again.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "common/memory/bytes.h"
#include "common/wire/image_messages.h"
#include "worker/shapes/drawn_tiles.h"

namespace slabstream {

// All members: any thread.
class SharedShapes {
 public:
  // The one of this setup. It lives as long as anybody holds it.
  static std::shared_ptr<SharedShapes> Of(const FrameSetup& setup);

  explicit SharedShapes(const FrameSetup& setup) : setup_(setup) {}

  // As MakeFrameShapes. Later calls wait for the first one, and return its result.
  Result<std::shared_ptr<const FrameShapes>> Make(std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                  const std::shared_ptr<const FrameLight>& light);
  // Tiles of another worker. A tile that is already drawn here stays.
  void Add(const ShapeTiles& message, const Bytes& payload);

 private:
  const FrameSetup setup_;
  const std::shared_ptr<DrawnTiles> tiles_ = std::make_shared<DrawnTiles>();
  std::mutex mutex_;  // guards what follows
  std::optional<Result<std::shared_ptr<const FrameShapes>>> shapes_;
};

}  // namespace slabstream
