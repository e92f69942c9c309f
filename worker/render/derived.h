// SlabData::Derived: what pipelines make once from a slab's voxels and keep while the transfer function selects the same voxels. One thread
// at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "worker/render/occupied_cells.h"
#include "worker/render/pipeline.h"
#include "worker/render/zbuffer/surface.h"

namespace slabstream {

struct SlabData::Derived {
  explicit Derived(SlabData& slab) : slab_(slab) {}

  // The table of this frame's transfer function. Valid until the next call.
  const ClassificationTable& Classification(const FrameSetup& setup);

  // Occupied voxels for the camera's traversal axis, in the slices of `box`. Valid until the next call of any function but Classification.
  const OccupiedCells& Occupied(const FrameSetup& setup, const Box& box);

  // Faces of the opaque voxels of `box`: opacity at least half of the largest that the volume's range of values has.
  const Surface& OpaqueSurface(const FrameSetup& setup, const Box& box);

  std::size_t bytes() const;

 private:
  const BrickRanges& Bricks();
  const CellBeams& Beams(const FrameSetup& setup, Axis u);

  SlabData& slab_;
  std::optional<BrickRanges> bricks_;

  // What the table was made from.
  std::optional<std::pair<TransferFunction, ValueRange>> classified_;
  ClassificationTable table_;

  BinSelection occupied_bins_;
  std::optional<CellBeams> along_x_, along_y_;
  static constexpr std::size_t kKeptViews = 8;
  std::deque<std::pair<Box, OccupiedCells>> occupied_;  // by the box they were made for; last used first

  BinSelection opaque_bins_;
  std::optional<std::pair<Box, Surface>> surface_;
};

}  // namespace slabstream
