#include "worker/renderers/raycast/layer_volume.h"

#include "common/base/check.h"

namespace slabstream {

const std::vector<LayerPiece>& LayerVolume::PiecesOf(const BoxData& data, std::span<const RayPiece> pieces, const LayerLooks& looks) {
  pieces_.resize(pieces.size());
  if (!looks.labels) return pieces_;
  const std::optional<BrickedVoxels>& labels = data.layers().labels;
  CHECK(labels.has_value()) << "labels are shown that the data does not have";
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    LayerPiece& piece = pieces_[i];
    if (piece.labels.samples != nullptr) continue;
    piece.labels = Pad(*labels, pieces[i].voxels.box);
    piece.label_cells = FindMacrocellRanges(piece.labels);
  }
  return pieces_;
}

std::size_t LayerVolume::bytes() const {
  std::size_t total = 0;
  for (const LayerPiece& piece : pieces_) {
    total += piece.labels.bytes() + piece.label_cells.bytes();
  }
  return total;
}

}  // namespace slabstream
