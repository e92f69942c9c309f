// CutFaces: clipping in the Z-buffer. A face of the surface is drawn where its depth is not clipped. Where a ray comes out of what is
// clipped away inside an opaque voxel, the cut through the voxel is seen: a flat face in the plane of the clip region's side.
//
// Where a ray is cut depends on the pixel and the region alone, in double precision, so all boxes agree on it. A face in the plane of a cut
// lies within kSlack of it and is not drawn: the cut stands for it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/frame/frame_setup.h"
#include "common/view/phong.h"
#include "worker/kernels/draw_faces.h"
#include "worker/renderers/bin_lookup.h"
#include "worker/renderers/slab_data.h"

namespace slabstream {

class CutFaces {
 public:
  // `opaque`: the bins of opaque voxels, by the slab's table. All must outlive this. The setup's clip region is not empty.
  CutFaces(SlabData& slab, const FrameSetup& setup, const Box& box, const BinSelection& opaque);

  // Whether depths from ... to are drawn (DepthLimits::inside).
  bool inside() const { return keep_; }
  // The limits of `count` pixels from (column, row) on.
  void Limits(std::int32_t column, std::int32_t row, std::size_t count, float* from, float* to) const;
  // Puts the cuts through voxels of the box in front of what lies behind them. `from` and `to` are the limits; `depth` and `voxel` are as
  // ShadeFaceRow fills them in.
  void Draw(std::int32_t column, std::int32_t row, std::size_t count, const float* from, const float* to, float* rgba, float* depth,
            std::uint32_t* voxel) const;

 private:
  // A quantity that is linear in a pixel's x and y.
  struct Linear {
    double at_0, by_x, by_y;
    double At(double x, double y) const { return at_0 + x * by_x + y * by_y; }
  };
  // Along a pixel's ray, the distance from the side is start + depth * rise.
  struct Side {
    Linear start, rise;
    PhongFactors light;
  };
  // The side that the ray of the pixel whose centre is (x, y) crosses at a depth.
  const Side& CutAt(double x, double y, double depth) const;
  std::uint16_t BinOf(const Index3& voxel) const;  // of a voxel of the box; kNotSelected if it is not opaque

  const VoxelBlock& voxels_;
  const Box box_;
  const bool keep_;
  double slack_;                              // physical
  std::array<Linear, 3> origin_, direction_;  // of a pixel's ray, data space: origin + depth * direction
  std::vector<Side> sides_;
  const ClassificationTable& table_;
  const BinSelection& opaque_;
  const Index3 bricks_;
};

}  // namespace slabstream
