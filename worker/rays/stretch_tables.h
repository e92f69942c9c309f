// StretchTables: where the voxels of a rectilinear grid lie (common/volume/stretch.h), as ray kernels look it up. Made once a frame.
#pragma once

#include <array>
#include <cstdint>

#include "common/memory/aligned_buffer.h"
#include "common/volume/stretch.h"

namespace slabstream {

// Of an axis with n voxels. Bins divide data space evenly into parts no longer than the shortest step of voxels, if 65536 do.
struct StretchTable {
  AlignedVector<float> knots;         // the places of the voxels -1, 0 ... n; empty: the axis is even, and there is nothing else
  AlignedVector<float> per_step;      // 1 / distance of each of them to the next one
  AlignedVector<float> slopes;        // 2 / distance of the two voxels beside each: 1 where even
  AlignedVector<std::int32_t> first;  // by bin: a knot at or before its begin
  std::int32_t first_step = 1;        // with halves of it after it, it leads from there to any knot of the bin
  AlignedVector<float> strides;       // by bin: a way along the axis that passes from a step between voxels to the next one at most
  float bins_a_unit = 1;

  bool even() const { return knots.empty(); }
};

struct StretchTables {
  std::array<StretchTable, 3> axes;
  float margin = 0;          // of data space: covers the rounding of positions
  Vec3 longest = {1, 1, 1};  // by axis: the longest stride

  explicit StretchTables(const Stretch& stretch);
};

}  // namespace slabstream
