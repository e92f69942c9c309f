// ActiveMacrocells: where passes have anything to resample. Beams elsewhere are empty and skipped.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/volume/bricks.h"
#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/ray_look.h"

namespace slabstream::shear {

// The range of samples in each cube of kRangeSide voxels, at global multiples, of a padded box.
inline constexpr std::int32_t kRangeSide = 4;
struct VoxelRanges {
  Index3 first, counts;  // cubes; x fastest
  std::vector<MacrocellRange> ranges;
};
// Parallel.
VoxelRanges FindVoxelRanges(const VoxelBricks& voxels);

// A cell is active if a sample that passes compute in it may matter for a visible one (ShearPasses: "Reach").
inline constexpr std::int32_t kCell = 8;  // voxels
struct ActiveMacrocells {
  std::array<std::int32_t, 3> first{}, counts{};  // cells, by place in ShearPasses::axes; the first is fastest
  std::vector<std::uint8_t> active;
  Box hull;  // a box of the volume that holds all voxels of active cells, and perhaps others; empty if there are none

  // Whether one of the cells is active in which lie [x_low, x_high] x [y_low, y_high] x z, in voxels, or the nearest ones.
  bool Any(float x_low, float x_high, float y_low, float y_high, float z) const;
};
ActiveMacrocells FindActiveMacrocells(const VoxelRanges& ranges, const VisibleSamples& visible, const std::array<Axis, 3>& axes);

}  // namespace slabstream::shear
