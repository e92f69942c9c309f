// RaycastCost: the time that the ray caster takes in a box, from how many of its samples are shaded.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream::raycast {

class RaycastCost : public AnalyticCost {
 public:
  explicit RaycastCost(const CostBasis& basis);
  double Seconds(const Box& box, const CostView& view) const override;

 private:
  const OccupancyGrid& drawn_;  // must outlive this
  const double opaque_depth_;   // voxel lengths of material after which rays end
};

}  // namespace slabstream::raycast
