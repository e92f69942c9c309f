// SplatCost: the time that splatting takes in a box, from its work: the lines of an OccupancyGrid's cells that are not empty (SplatWork).
//
// A view along x crosses slices of constant x with beams along y (along y: the other way round). A beam reaches the four rows of samples
// next to it. Cells along the beams may reach the same rows, and boxes end between any two rows: sets of lines count both exactly. Samples
// behind opaque ones are not drawn, so the optical depth of rays is followed through the box, by rows of samples and by cells along the
// beams, in a view from 20 degrees above that is turned from the axis. Slanting rays leave a thin box before they are opaque, so the depth
// of the box across the slices says little.
#pragma once

#include "common/math/vec.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream::splat {

// At one pixel for the smallest side of a voxel.
struct SplatCounts {
  double slices = 0;    // slices in which anything is drawn
  double rows = 0;      // rows of samples that anything reaches, over all slices
  double segments = 0;  // segments of rows, a cell long, that are not empty
  double runs = 0;      // runs of such segments, one beside the other
  double octets = 0;    // octets of voxels, a cell long along a beam, that are not empty
};

class SplatWork {
 public:
  // `grid` must outlive this. `spacing`: > 0. `extinction`: of occupied voxels, for a voxel length, >= 0.
  SplatWork(const OccupancyGrid& grid, const Vec3& spacing, double extinction);

  // `box` lies inside the volume and is not empty; `along` is x or y. Seen from the axis' lower end: from the upper end about as much is
  // hidden (five volumes were predicted as well as with each end for itself).
  SplatCounts Count(const Box& box, Axis along) const;

 private:
  double PixelsPerVoxel(Axis axis) const;

  const OccupancyGrid& grid_;
  const Vec3 spacing_;
  const double extinction_;
  double least_spacing_;
};

// The median extinction coefficient of a voxel length, over the voxels that show anything, by the volume's histogram; finite, >= 0. In a
// mostly thin volume, a few dense voxels would decide a mean.
double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary);

// `drawn` must outlive the result. `spacing` > 0. `extinction` as above.
AnalyticCost SplatCost(const OccupancyGrid& drawn, const Vec3& spacing, double extinction);

}  // namespace slabstream::splat
