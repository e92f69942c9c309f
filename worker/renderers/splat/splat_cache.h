// SplatCache: the occupied voxels of a padded box, by beams. Splatting keeps them between frames until the transfer function shows other
// voxels.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "worker/renderers/box_data.h"
#include "worker/renderers/recent_boxes.h"
#include "worker/renderers/splat/occupied_voxels.h"

namespace slabstream {

class SplatCache : public BoxCache {
 public:
  // Occupied voxels for the camera's traversal axis, in the slices of `box`. Valid until the next call.
  const OccupiedVoxels& Occupied(BoxData& data, const FrameSetup& setup, const Box& box);

  std::size_t bytes() const override;

 private:
  const VoxelBeams& Beams(BoxData& data, const FrameSetup& setup, Axis u);

  BinSelection occupied_bins_;
  std::optional<VoxelBeams> along_x_, along_y_;
  std::array<RecentBoxes<OccupiedVoxels>, 3> occupied_;  // by traversal axis; they refer to the beams
};

}  // namespace slabstream
