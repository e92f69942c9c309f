// LayerVolume: the layers of a slab as the ray caster reads them, piece by piece like RayVolume. It stays with the slab between frames.
#pragma once

#include <span>
#include <vector>

#include "common/frame/layer_look.h"
#include "worker/rays/ray_volume.h"
#include "worker/renderers/raycast/ray_layers.h"

namespace slabstream {

// Empty: the layer was not needed so far.
struct LayerPiece {
  PaddedVoxels labels, overlay;
  CellRanges label_cells, overlay_cells;
};

class LayerVolume : public SlabCache {
 public:
  // With the layers that `looks` shows, which the slab has; `pieces` are those of its RayVolume. Made by the first call that needs a layer.
  // Parallel.
  const std::vector<LayerPiece>& PiecesOf(const SlabData& slab, std::span<const RayPiece> pieces, const LayerLooks& looks);

  std::size_t bytes() const override;

 private:
  std::vector<LayerPiece> pieces_;
};

}  // namespace slabstream
