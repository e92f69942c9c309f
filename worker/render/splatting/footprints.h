// Footprints: the footprint kernels of a frame.
//
// Orthographic: one pair. Perspective: the shape is taken once for each cell of kFootprintCell x kFootprintCell voxels of a slice (at
// global multiples), at the centre of the part of the cell that lies in the volume, and rounded to a ladder of 2^(1/32) (1.1 % at most), so
// that a frame needs a few dozen tables. Weights still sum to 1 everywhere, because the area that a voxel stands for is exact voxel by
// voxel; so steps between cells do not show.
#pragma once

#include <map>
#include <vector>

#include "worker/kernels/gaussian_kernel.h"
#include "worker/render/splatting/slice_projection.h"

namespace slabstream {

struct FootprintPair {
  const GaussianKernel* x = nullptr;
  const GaussianKernel* y = nullptr;
};

// Rounds to the ladder; the identity for an orthographic camera, whose sigmas are the same everywhere.
double LadderSigma(double sigma, bool perspective);

class Footprints {
 public:
  // For cells that overlap the in-slice extent of `box`. `projection` must outlive this.
  Footprints(const SliceProjection& projection, const VolumeGeometry& geometry, const Box& box);

  void SetSlice(std::int32_t k);

  // Of the cell with numbers voxel / kFootprintCell. Valid as long as this object.
  const FootprintPair& At(std::int32_t cell_u, std::int32_t cell_v) const {
    return pairs_[std::size_t(cell_v - first_v_) * std::size_t(count_u_) + std::size_t(cell_u - first_u_)];
  }

 private:
  const GaussianKernel* Kernel(double sigma);

  const SliceProjection& projection_;
  Index3 volume_size_;
  std::int32_t first_u_, count_u_, first_v_, count_v_;  // cells
  std::vector<FootprintPair> pairs_;
  std::map<double, GaussianKernel> kernels_;  // by sigma; references stay valid
};

}  // namespace slabstream
