// SharedShapes: the shapes of a frame in the whole process. The workers and the boxes of a frame share them, and so do frames that look
// the same. Tiles that other processes have drawn need not be drawn here.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "common/memory/bytes.h"
#include "common/wire/image_messages.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// Any thread, of all members.
class SharedShapes {
 public:
  // Those of this frame. They live as long as anybody holds them; some latest ones live longer.
  static std::shared_ptr<SharedShapes> Of(const FrameSetup& setup);

  explicit SharedShapes(const FrameSetup& setup);

  // As MakeFrameShapes. The first call makes them, and others wait.
  Result<std::shared_ptr<const FrameShapes>> Make(std::span<const std::shared_ptr<const VoxelBlock>> bytes,
                                                  const std::shared_ptr<const FrameLight>& light);
  // Tiles of another worker, before they are first asked for. One that cannot be read is drawn here. A tile that is there already stays.
  void Add(const ShapeTiles& message, const Bytes& payload);

 private:
  class Arrived;

  const FrameSetup setup_;
  const std::shared_ptr<Arrived> arrived_;
  std::mutex mutex_;  // guards what follows
  std::optional<Result<std::shared_ptr<const FrameShapes>>> shapes_;
};

}  // namespace slabstream
