// ZBufferCost: the time that the Z-buffer takes in a box, from the cells through which surfaces pass.
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream::zbuffer {

class ZBufferCost : public AnalyticCost {
 public:
  explicit ZBufferCost(const OccupancyGrid& drawn) : drawn_(drawn) {}  // must outlive this
  double Seconds(const Box& box, const CostView& view) const override;

 private:
  const OccupancyGrid& drawn_;
};

}  // namespace slabstream::zbuffer
