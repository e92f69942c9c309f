// BoxEstimator: estimates the time and the coverage of boxes in one view, before anybody has rendered them.
//
// It projects cells of occupied voxels: each becomes a rectangle of the frame that its voxels hit at random. In the part of a tile that
// rectangles reach, a pixel that expects n hits is filled with probability 1 - exp(-n). Cells behind the frame's front (FrameSetup::front)
// are not drawn. Neighbouring cells are merged until there are at most kMostCells, so that estimating all boxes of a layout takes about a
// millisecond.
#pragma once

#include <vector>

#include "common/image/coverage_map.h"
#include "common/planning/cost_estimator.h"
#include "common/planning/frame_plan.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

class BoxEstimator {
 public:
  static constexpr std::int64_t kMostCells = 32 * 32 * 32;

  // Coverage is for a coarse frame: each of its pixels is `pixel_side` x `pixel_side` pixels of the true one (>= 1). `measured`: as for
  // CostEstimator. All arguments must live as long as this.
  BoxEstimator(const FrameSetup& setup, const VolumeSummary& summary, const OccupancyGrid& occupied, const WorkField* measured,
               std::int32_t pixel_side);

  struct Estimate {
    double seconds = 0;    // of one thread
    CoverageMap coverage;  // of the box's image
  };
  Estimate Of(const Box& box) const;  // inside the volume, not empty

 private:
  // Whether the front hides a box that is seen on `seen`, as far as the rays of its middle tell.
  bool IsHidden(const Box& box, const FrameArea& seen) const;

  const FrameSetup& setup_;
  const CostEstimator cost_;
  const bool measured_;
  const CostView view_;
  const PixelBounds frame_;
  const std::int32_t pixel_side_;
  const Index3 size_;
  std::int32_t side_ = kOccupancyCell;  // voxels of a cell
  Index3 cells_;
  std::vector<double> cell_;  // occupied voxels, x fastest
  double voxel_pixels_;       // pixels that a voxel hits
};

}  // namespace slabstream
