// LayerVolume: the layers of a padded box as the ray caster reads them, piece by piece like RayVolume. It stays with the padded box between
// frames.
#pragma once

#include <span>
#include <vector>

#include "common/frame/layer_look.h"
#include "worker/rays/ray_volume.h"
#include "worker/renderers/raycast/ray_layers.h"

namespace slabstream {

// Empty: the layer was not needed so far.
struct LayerPiece {
  PaddedVoxels labels;
  MacrocellRanges label_cells;
};

class LayerVolume : public BoxCache {
 public:
  // With the layers that `looks` shows, which the padded box has; `pieces` are those of its RayVolume. Made by the first call that needs a
  // layer. Parallel.
  const std::vector<LayerPiece>& PiecesOf(const BoxData& data, std::span<const RayPiece> pieces, const LayerLooks& looks);

  std::size_t bytes() const override;

 private:
  std::vector<LayerPiece> pieces_;
};

}  // namespace slabstream
