// SplatCost: the time that splatting takes in a box, from the lines of cells that are not empty (SplatWork).
#pragma once

#include "common/renderers/renderer_kind.h"

namespace slabstream::splat {

// The median extinction coefficient of a voxel length, over the voxels that show anything, by the volume's histogram; finite, >= 0. In a
// mostly thin volume, a few dense voxels would decide a mean.
double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary);

// `drawn` must outlive the result. `spacing` > 0. `extinction` as above.
AnalyticCost SplatCost(const OccupancyGrid& drawn, const Vec3& spacing, double extinction);

}  // namespace slabstream::splat
