// BrickVisibility: whether a renderer may draw any voxel of a box. The value ranges of the summary's bricks tell; no voxels are needed.
//
// Rounding is conservative: a box that is called empty holds no voxel whose bin has an opacity above zero in the renderer's DrawnTable, and
// none that other fields or labels show.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "common/classification/classification_table.h"
#include "common/view/clip.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

class BrickVisibility {
 public:
  // `summary` must outlive this. `layers`: OtherBricks (other_bricks.h).
  BrickVisibility(const VolumeSummary& summary, ClassificationTable drawn, std::vector<std::uint8_t> layers = {})
      : BrickVisibility(summary, summary.bricks, std::move(drawn), std::move(layers)) {}
  // By other ranges of the bricks than summary.bricks. They must outlive this, too.
  BrickVisibility(const VolumeSummary& summary, const BrickRangeList& bricks, ClassificationTable drawn,
                  std::vector<std::uint8_t> layers = {});

  // The brick can be visible.
  bool AnyVisible(std::size_t brick) const {
    return (bricks_.empty() ? any_value_visible_ : Visible(bricks_[brick])) || (!layers_.empty() && layers_[brick] != 0);
  }

  // True if a brick that touches `box` (not empty, inside the volume) can be visible.
  bool AnyVisible(const Box& box) const;

  // The bricks that can be visible and are not clipped away; the volume as a whole, if there are no ranges of bricks.
  std::vector<Box> VisibleBricks(const ClipRegion& clip = {}) const;

  // Counts all voxels of bricks that can be visible as occupied: a substitute for an exact count.
  OccupancyGrid VisibleCells() const;

 private:
  bool Visible(const ValueRange& brick) const;
  double StoredFromData(double value) const;

  const VolumeSummary& summary_;
  const BrickRangeList& bricks_;
  ClassificationTable table_;
  std::vector<std::uint8_t> layers_;  // by brick; empty: none
  std::vector<int> next_visible_;     // by bin: the lowest bin at or above it with an opacity above zero; table_.size(): none
  bool any_value_visible_ = false;    // a brick of which nothing is known
};

}  // namespace slabstream
