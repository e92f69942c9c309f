#include "coordinator/cell_bytes.h"

#include <algorithm>

namespace slabstream {

Bytes CellBytes::Of(const std::shared_ptr<const MeshCutter>& cells, const Box& box) {
  kept_.remove_if([](const Piece& piece) { return piece.of.expired(); });
  const auto found = std::ranges::find_if(kept_, [&](const Piece& piece) { return piece.of.lock() == cells && piece.box == box; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front().bytes;
  }
  kept_.push_front({cells, box, Bytes(EncodeMesh(cells->Cut(box)))});
  std::size_t bytes = 0;
  for (auto piece = kept_.begin(); piece != kept_.end();) {
    bytes += piece->bytes.size();
    piece = bytes > kMostKept && piece != kept_.begin() ? kept_.erase(piece) : std::next(piece);
  }
  return kept_.front().bytes;
}

}  // namespace slabstream
