// SplatCache: the occupied voxels of a slab, by beams. Splatting keeps them between frames until the transfer function shows other voxels.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "worker/renderers/recent_boxes.h"
#include "worker/renderers/slab_data.h"
#include "worker/renderers/splat/occupied_cells.h"

namespace slabstream {

class SplatCache : public SlabCache {
 public:
  // Occupied voxels for the camera's traversal axis, in the slices of `box`. Valid until the next call.
  const OccupiedCells& Occupied(SlabData& slab, const FrameSetup& setup, const Box& box);

  std::size_t bytes() const override;

 private:
  const CellBeams& Beams(SlabData& slab, const FrameSetup& setup, Axis u);

  BinSelection occupied_bins_;
  std::optional<CellBeams> along_x_, along_y_;
  std::array<RecentBoxes<OccupiedCells>, 3> occupied_;  // by traversal axis; they refer to the beams
};

}  // namespace slabstream
