// WorkField: how work is distributed in a volume, so that boxes of equal work can be cut.
//
// Work is known for each macrocell of an OccupancyGrid and assumed to be even within a macrocell. Sums over boxes come from a summed-volume
// table (Crow, "Summed-area tables for texture mapping", 1984, in three dimensions), so a lookup takes the same time for a box of any size.
// Values, immutable.
#pragma once

#include <span>
#include <vector>

#include "common/volume/occupancy_grid.h"

namespace slabstream {

// Work of every macrocell of the grid: 1 for each occupied voxel, and calibration::kMacrocellWork more if the macrocell has any.
std::vector<double> MacrocellWork(const OccupancyGrid& grid);

class WorkField {
 public:
  // Every voxel of a volume of `size` is work 1.
  static WorkField Uniform(const Index3& size);
  explicit WorkField(const OccupancyGrid& grid) : WorkField(grid.size, MacrocellWork(grid)) {}
  // `work` by macrocell of an OccupancyGrid of this size: finite, >= 0. Kept in steps of 2^-40 of the total, none of them lost.
  WorkField(const Index3& size, std::span<const double> work);

  const Index3& size() const { return size_; }
  bool uniform() const { return sums_.empty(); }
  double total() const { return Sum({{0, 0, 0}, size_}); }

  // Work in `box`, which is cut to the volume and may be empty.
  double Sum(const Box& box) const;

  // The smallest box of macrocells, cut to `box`, that holds all work of `box`; empty if there is none. All of `box` if work is uniform.
  Box Hull(const Box& box) const;

 private:
  explicit WorkField(const Index3& size) : size_(size) {}
  void SumUp(std::span<const double> steps);
  double Before(const Index3& corner) const;  // steps in [0, corner)
  double StepsOf(const Box& cells) const;     // steps in a box of whole cells

  Index3 size_;
  Index3 corners_;            // cells + 1
  double step_ = 1;           // work of one step
  std::vector<double> sums_;  // steps before a corner of cells, [z][y][x]: whole numbers, so that sums are exact
};

// The plane `axis = p` that divides the work of `box` (its voxels if it holds no work) most nearly in the proportion part : whole - part,
// 0 < part < whole. p is the first index of the upper part and lies strictly inside the box, which has two slices or more. If work is
// uniform, p is rounded down, so that slab i of n begins at slice i * slices / n.
std::int32_t PlaneAt(const WorkField& work, const Box& box, Axis axis, std::int64_t part, std::int64_t whole);

}  // namespace slabstream
