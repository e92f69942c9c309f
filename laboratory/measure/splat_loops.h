// DenseSlice: splatting and compositing of a filled slice, side x side shaded voxels into a frame, in two ways: by the pipeline's kernels,
// band by band as in the pipeline; and by the loop that they replace, which adds k x k weighted pixels into a sheet for each voxel
// (Westover 1990) and then composites the sheet. For timing: both do the work of a slice, and their pixels are not used.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "worker/kernels/footprint_table.h"
#include "worker/kernels/segment_set.h"

namespace slabstream {

class DenseSlice {
 public:
  // `side` voxels, [1, 4096]; footprints of `sigma` voxels, cut at three of them, sigma <= 5; `scale` pixels a voxel, [0.5, 2].
  DenseSlice(std::int32_t side, double sigma, double scale);

  void SplatByKernels();
  void SplatPlainly();
  std::int32_t taps() const { return footprint_.taps; }        // k, in voxels
  const float* pixels() const { return accumulated_.data(); }  // of the frame, so that a compiler must compute them

 private:
  std::int32_t side_;
  FootprintTable footprint_;
  std::int32_t pixels_;  // a side of the frame
  Lattice lattice_;      // along both axes
  std::int32_t row_voxels_;
  AlignedVector<float> voxels_, accumulated_, filtered_, sheet_;
  std::int32_t words_;
  std::vector<SegmentWord> all_, open_;  // every segment of a row; those that are not opaque yet
};

}  // namespace slabstream
