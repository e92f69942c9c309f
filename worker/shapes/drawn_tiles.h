// DrawnTiles: shape tiles of a frame, drawn by other workers, as bytes (tile_coding.h), until they are taken.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "common/memory/bytes.h"
#include "worker/shapes/frame_shapes.h"

namespace slabstream {

// Any thread.
class DrawnTiles {
 public:
  // `tile`: its number in ShapeGrid(FrameBounds(setup)).
  void Add(std::uint32_t tile, Bytes bytes) {
    const std::lock_guard lock(mutex_);
    tiles_.insert_or_assign(tile, std::move(bytes));
  }
  // None: it is not there, or cannot be read.
  std::optional<ShapeTile> Take(std::uint32_t tile, const PixelBounds& pixels);

 private:
  std::mutex mutex_;
  std::map<std::uint32_t, Bytes> tiles_;
};

}  // namespace slabstream
