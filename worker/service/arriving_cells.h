// ArrivingCells: the cells of a padded box while their chunks are stored.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/mesh.h"
#include "common/wire/voxel_messages.h"

namespace slabstream {

class ArrivingCells {
 public:
  // Unpacks a chunk, which has come through Decode (IsCellChunk). One that is stored already changes nothing. DataLoss: it does not fit the
  // others, is damaged, or all of them are not the cells of a box. ResourceExhausted: the cells do not fit the memory.
  Status Store(const Chunk& chunk, std::span<const std::byte> payload);

  // Once all chunks are stored; else null.
  const std::shared_ptr<const Mesh>& cells() const { return cells_; }

 private:
  std::vector<std::byte> bytes_;
  std::vector<bool> stored_;  // by chunk
  std::size_t missing_ = 0;
  std::shared_ptr<const Mesh> cells_;
};

}  // namespace slabstream
