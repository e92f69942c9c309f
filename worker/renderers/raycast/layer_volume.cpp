#include "worker/renderers/raycast/layer_volume.h"

#include "common/base/check.h"

namespace slabstream {

const std::vector<LayerPiece>& LayerVolume::PiecesOf(const BoxData& data, std::span<const RayPiece> pieces, const LayerLooks& looks) {
  pieces_.resize(pieces.size());
  const auto make = [&](const std::optional<BrickedVoxels>& voxels, PaddedVoxels LayerPiece::*padded, MacrocellRanges LayerPiece::*cells) {
    CHECK(voxels.has_value()) << "a layer is shown that the data does not have";
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      LayerPiece& piece = pieces_[i];
      if ((piece.*padded).samples != nullptr) continue;
      piece.*padded = Pad(*voxels, pieces[i].voxels.box);
      piece.*cells = FindMacrocellRanges(piece.*padded);
    }
  };
  if (looks.labels) make(data.layers().labels, &LayerPiece::labels, &LayerPiece::label_cells);
  if (looks.overlay) make(data.layers().overlay, &LayerPiece::overlay, &LayerPiece::overlay_cells);
  return pieces_;
}

std::size_t LayerVolume::bytes() const {
  std::size_t total = 0;
  for (const LayerPiece& piece : pieces_) {
    total += piece.labels.bytes() + piece.overlay.bytes() + piece.label_cells.bytes() + piece.overlay_cells.bytes();
  }
  return total;
}

}  // namespace slabstream
