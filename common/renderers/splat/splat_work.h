// SplatWork: what splatting has to do in a box, counted from which lines of an OccupancyGrid's cells hold anything.
//
// A view along x crosses slices of constant x, whose beams run along y (along y: the other way round). A beam reaches the four rows of
// samples next to it. Rows that several cells along the beams reach are the same rows, and boxes end between any two of them: sets of lines
// tell both exactly. What lies behind opaque samples is not drawn. So the depth of rays is followed through the box, by rows of samples and
// by cells along the beams, in a view from 20 degrees above that is turned from the axis: rays that slant leave a thin box before they are
// opaque, which is why its depth across the slices says little.
#pragma once

#include <cstdint>

#include "common/math/vec.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream::splat {

// At a pixel for the smallest of a voxel's sides.
struct SplatCounts {
  double slices = 0;    // in which anything is drawn
  double rows = 0;      // of samples that anything reaches, over all slices
  double segments = 0;  // of rows, a cell long, that hold anything
  double runs = 0;      // of such segments, one beside the other
  double octets = 0;    // of voxels, a cell long along a beam, that hold anything
};

class SplatWork {
 public:
  // `grid` must outlive this. `spacing`: > 0. `extinction`: of what is occupied, a voxel length, >= 0.
  SplatWork(const OccupancyGrid& grid, const Vec3& spacing, double extinction);

  // `box` lies inside the volume and is not empty; `along` is x or y. Seen from the axis' lower end: what is hidden from the upper one is
  // about as much (five volumes were foretold as well as by either end for itself).
  SplatCounts Count(const Box& box, Axis along) const;

 private:
  double PixelsPerVoxel(Axis axis) const;

  const OccupancyGrid& grid_;
  const Vec3 spacing_;
  const double extinction_;
  double least_spacing_;
};

}  // namespace slabstream::splat
