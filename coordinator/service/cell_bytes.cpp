#include "coordinator/service/cell_bytes.h"

#include <utility>

namespace slabstream {

Bytes CellBytes::Of(const std::shared_ptr<const MeshCutter>& cells, const Box& box) {
  kept_.DropIf([](const auto& entry) { return entry.value.of.expired(); });
  if (const Piece* found = kept_.Find({cells.get(), box})) return found->bytes;
  Bytes bytes(EncodeMesh(cells->Cut(box)));
  const std::size_t size = bytes.size();
  const Piece& piece = kept_.Put({cells.get(), box}, {cells, std::move(bytes)}, size);
  kept_.DropBeyond(kMostKept);
  return piece.bytes;
}

}  // namespace slabstream
