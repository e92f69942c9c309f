// SliceClip: which samples of a slice clipping leaves, and which voxels are lit as parts of a flat cut.
//
// A sample is where a pixel's ray meets the slice (slice_samples.h). Along a row of the frame such points move evenly, so the region holds
// one interval of columns. It depends on slice and row alone: boxes agree on it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/frame/frame_setup.h"

namespace slabstream {

// Columns [begin, end) of a row; empty if begin >= end.
struct ColumnInterval {
  std::int32_t begin = 0, end = 0;
  bool empty() const { return begin >= end; }
};

class SliceClip {
 public:
  explicit SliceClip(const FrameSetup& setup);  // `setup` must outlive this

  bool empty() const { return setup_.clip.empty(); }
  // The columns that are left of a row of slice k, in ascending order.
  std::array<ColumnInterval, 2> ColumnsLeft(std::int32_t k, std::int32_t row) const;
  // Sets the codes (normal_code.h) of the voxels of a row that lie within kFaceDepth of a cut, voxel + i for i < count along u, to that of
  // the cut's normal. The others stay. Returns whether any was set.
  bool LightCuts(std::int32_t k, std::int32_t v, std::int32_t u, std::int32_t count, std::uint16_t* normals) const;

 private:
  const FrameSetup& setup_;
  SliceAxes axes_;
  double face_reach_;                   // physical
  std::vector<std::uint16_t> normals_;  // codes, by side
};

}  // namespace slabstream
