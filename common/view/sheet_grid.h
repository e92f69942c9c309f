// SheetGrid: the image that splatting renders, aligned with the slices of the volume (the intermediate image of Lacroute and Levoy's
// shear-warp factorization, 1994). All rays of a camera that meet the slices meet them in the same order of rows and columns. So if columns
// of the image run along u and its rows along v, each slice appears in it as a sheet that is only scaled and shifted:
//
//   column(u, k) = (x_u u + x_c k + x_0) / w(k),   row(v, k) = (y_v v + y_c k + y_0) / w(k),   w(k) = w_c k + w_0
//
// with k, u, v data-space coordinates along the traversal axis c and the two axes u < v in the slice, and pixel (i, j) centred at
// (i + 0.5, j + 0.5). Orthographic: w = 1. A pixel of the grid is one ray, the same for all slices; the frame that workers combine is made
// of such pixels, and the display worker resamples it to the picture by a projective map (ResamplePicture) at the end.
//
// Resolution: at the volume's centre, a column is as wide as a pixel of the picture, but at least half a voxel (a
// footprint has no finer detail to show) and at most two voxels (so that a footprint reaches a bounded number of
// voxels). Rows have the same limits.
#pragma once

#include <array>
#include <cstdint>

#include "common/view/camera.h"

namespace slabstream {

struct SliceAxes {
  Axis c, u, v;  // traversal axis, along beams, from beam to beam
};
constexpr SliceAxes AxesOf(Axis traversal) {
  return {traversal, traversal == Axis::kX ? Axis::kY : Axis::kX, traversal == Axis::kZ ? Axis::kY : Axis::kZ};
}

inline constexpr double kMinGridPixelsPerVoxel = 0.5, kMaxGridPixelsPerVoxel = 2;
inline constexpr std::int32_t kMaxGridSide = 1 << 17;  // pixels, of a grid that can be rendered
inline constexpr std::int32_t kGridColumnStep = 8;     // the width is a multiple of this

struct SheetGrid {
  double x_u = 1, x_c = 0, x_0 = 0;
  double y_v = 1, y_c = 0, y_0 = 0;
  double w_c = 0, w_0 = 1;
  double shear_u = 0, shear_v = 0;     // the central ray's slope: voxels along u and v from one slice to the next
  double footprint = 1;                // footprints are so many times as wide as usual, [1, kMaxFootprint]
  std::int32_t width = 0, height = 0;  // pixels, at least 1
  // Row major. With (X, Y, W) = from_picture (x, y, 1): the point (x, y) of the picture lies at (X / W, Y / W) in the grid; W <= 0: its ray
  // meets no slice.
  std::array<double, 9> from_picture{};

  bool empty() const { return width == 0; }  // no grid
  friend bool operator==(const SheetGrid&, const SheetGrid&) = default;
};

inline constexpr double kMaxFootprint = 3;  // the largest SheetGrid::footprint

// The grid for the picture of `camera` (not supersampled). Its sides may exceed kMaxGridSide under perspective, if an oblique view sees
// many slices that lie hundreds of voxel widths apart: PlanFrame refuses such views.
SheetGrid MakeSheetGrid(const Camera& camera, const VolumeGeometry& geometry, double footprint = 1);

// In slice k: column = scale_u u + offset_u, row = scale_v v + offset_v; the scales are pixels a voxel, > 0.
struct SlicePlacement {
  double scale_u, offset_u, scale_v, offset_v;
};
inline SlicePlacement PlaceSlice(const SheetGrid& grid, double k) {
  const double per_w = 1 / (grid.w_c * k + grid.w_0);
  return {grid.x_u * per_w, (grid.x_c * k + grid.x_0) * per_w, grid.y_v * per_w, (grid.y_c * k + grid.y_0) * per_w};
}

// The footprint of a voxel within its slice: the product of a Gaussian along u and one along v, cut off at kFootprintCut standard
// deviations. It is the shadow that a round Gaussian of variance kFootprintVoxelVariance casts along the central ray on its slice, without
// the correlation of u and v, and with the shear limited to kMaxFootprintShear (slices far apart), and never so narrow that the grid could
// miss it. SheetGrid::footprint makes it wider, up to kMaxFootprintSigma.
inline constexpr double kFootprintVoxelVariance = 0.36;  // voxels^2
inline constexpr double kFootprintGridVariance = 0.3;    // pixels^2 of the grid, the least
inline constexpr double kFootprintCut = 3;               // standard deviations
inline constexpr double kMaxFootprintShear = 3;          // voxels a slice
inline constexpr double kMaxFootprintSigma = 2;          // voxels: the widest footprint reaches 6 voxels
struct FootprintSigma {
  double u, v;  // voxels
};
FootprintSigma FootprintIn(const SheetGrid& grid, const SlicePlacement& slice);

// The largest scale of a slice in any view is 12 pixels a voxel: next to the eye of a wide perspective view. Grids with scales
// above this are refused:
inline constexpr double kMaxSliceScale = 24;

// Voxels that a worker must hold round its own to compute all its samples exactly: the reach of the widest footprint of any view, at most
// 6 voxels, and one for gradients. (The Z-buffer's normals need 2.)
inline constexpr int kHalo = 8;

}  // namespace slabstream
