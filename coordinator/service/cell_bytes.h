// CellBytes: the cells of boxes as bytes, as they are sent. Those that were cut last are kept, because a box is asked for chunk by chunk.
// One thread uses it.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include "common/base/lru_map.h"
#include "common/memory/bytes.h"
#include "common/mesh/mesh_part.h"
#include "common/volume/box.h"

namespace slabstream {

class CellBytes {
 public:
  // The bytes of the cells in `box`, as EncodeMesh makes them. The box is not empty.
  Bytes Of(const std::shared_ptr<const MeshCutter>& cells, const Box& box);

 private:
  static constexpr std::size_t kMostKept = std::size_t{256} << 20;  // bytes; the last one stays in any case
  struct Piece {
    std::weak_ptr<const MeshCutter> of;  // a dataset that is gone takes no memory
    Bytes bytes;
  };
  LruMap<std::pair<const MeshCutter*, Box>, Piece> kept_;
};

}  // namespace slabstream
