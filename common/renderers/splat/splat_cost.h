// SplatCost: the time that splatting takes in a box, from the lines of cells that are not empty (splat_work.h).
#pragma once

#include "common/renderers/renderer_kind.h"
#include "common/renderers/splat/splat_work.h"

namespace slabstream::splat {

// The median extinction coefficient of a voxel length, over the voxels that show anything, by the volume's histogram; finite, >= 0. In a
// mostly thin volume, a few dense voxels would decide a mean.
double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary);

class SplatCost : public AnalyticCost {
 public:
  explicit SplatCost(const CostBasis& basis)
      : SplatCost(*basis.drawn, basis.summary->description.geometry.spacing, MedianExtinction(*basis.transfer, *basis.summary)) {}
  // `drawn` must outlive this. `spacing` > 0. `extinction` as above.
  SplatCost(const OccupancyGrid& drawn, const Vec3& spacing, double extinction) : work_(drawn, spacing, extinction) {}

  double Seconds(const Box& box, const CostView& view) const override;

 private:
  double SecondsAlong(const Box& box, Axis along, double scale) const;

  const SplatWork work_;
};

}  // namespace slabstream::splat
