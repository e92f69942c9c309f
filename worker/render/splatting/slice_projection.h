// SliceProjection: the camera as splatting sees it, in coordinates of a slice: (u, v) in the slice, k its index along the traversal axis.
//
// A voxel's homogeneous image coordinates are linear in (u, v, k). They are scaled so that w is 1 at the volume's middle (orthographic:
// everywhere).
#pragma once

#include <array>

#include "common/volume/volume.h"
#include "worker/render/occupied_cells.h"

namespace slabstream {

struct Homogeneous {
  double x = 0, y = 0, w = 1;  // pixel (x / w, y / w)
};
constexpr Homogeneous operator+(const Homogeneous& a, const Homogeneous& b) { return {a.x + b.x, a.y + b.y, a.w + b.w}; }
constexpr Homogeneous operator*(double s, const Homogeneous& a) { return {s * a.x, s * a.y, s * a.w}; }
constexpr double Determinant(const Homogeneous& a, const Homogeneous& b, const Homogeneous& c) {
  return a.x * (b.y * c.w - b.w * c.y) - a.y * (b.x * c.w - b.w * c.x) + a.w * (b.x * c.y - b.y * c.x);
}

struct FootprintSigma {
  double x, y;  // pixels
};

class SliceProjection {
 public:
  SliceProjection(const Camera& camera, const VolumeGeometry& geometry);

  bool perspective() const { return perspective_; }
  const SliceAxes& axes() const { return axes_; }
  const Homogeneous& step_u() const { return step_u_; }
  const Homogeneous& step_v() const { return step_v_; }
  Homogeneous SliceOrigin(double k) const { return origin_ + k * step_k_; }  // of voxel (0, 0, k)
  Homogeneous At(double u, double v, double k) const { return SliceOrigin(k) + v * step_v_ + u * step_u_; }

  // |det d(x, y) / d(u, v)| * w^3, the same for all voxels of slice k: the area in pixels^2 of a voxel's cell of the slice is this by w^3.
  double CellArea(double k) const;

  // Standard deviations of the footprint at a place of the volume: the shadow of a Gaussian of kFootprintVoxelVariance along each axis,
  // plus the pixel's kFootprintPixelVariance. The shadow's covariance xy, which a footprint with axes x and y cannot follow, widens both.
  FootprintSigma SigmaAt(double u, double v, double k) const;

  // Physical distance of neighbouring sheets along the central ray.
  double sheet_distance() const { return sheet_distance_; }

 private:
  SliceAxes axes_;
  bool perspective_;
  Homogeneous origin_, step_u_, step_v_, step_k_;
  double sheet_distance_;
};

}  // namespace slabstream
