// ShearPasses: a view as three one-dimensional passes (Catmull and Smith 1980 for images, Hanrahan 1990 for volumes).
//
// Lattice point (u, v, k) of the picture is sample k of the ray through column u of row v; u and v are counted from the picture's centre.
// (If `turned`, u is its row and v its column.) Its place in the volume is an affine function of (u, v, k). The passes introduce u, v and k
// one after the other, each for one data axis, which are called x, y and z here, independent of their names in the volume:
//
//   1. (x, y, z) -> (u, y, z): along a beam of x, the point u lies at x = x_u u + x_y y + x_z z + x_0
//   2. (u, y, z) -> (u, v, z): along y, v lies at y = y_u u + y_v v + y_z z + y_0
//   3. (u, v, z) -> (u, v, k): along z, k lies where the ray is (ViewRays)
//
// A pass reads samples along its own axis alone, at places that it computes from whole numbers, so each intermediate sample is the same
// whoever computes it.
//
// The order. Pass 2 fails if a ray never crosses slices of z, pass 1 if a row of beams never crosses columns: an intermediate volume is
// squeezed to nothing, the bottleneck of Catmull and Smith (1980). So z is the axis along which rays move most voxels a sample, and y and v
// are such that |y_v| is the largest of the four movements in a slice, from one column or row to the next: Gaussian elimination with
// pivots. (The last pass makes rays, so that samples can be composited as they come.) That leaves shears of at most one voxel a voxel:
//
//   |slide_x|, |slide_y| <= 1    voxels along x and y from slice to slice on a ray
//   |x_y| <= 1
//
// Reach. A kernel that reaches h voxels makes sample (u, v, k) at (x, y, z) from voxels less than h (1 + |x_y| + |slide_x|) <= 3 h away
// along x, h (1 + |slide_y|) <= 2 h along y and h along z. With h = 2 these are 6, 4 and 2, for any view.
#pragma once

#include <array>

#include "common/math/vec.h"
#include "worker/rays/view_rays.h"

namespace slabstream::shear {

struct ShearPasses {
  std::array<Axis, 3> axes{};  // which axes of the volume x, y and z are
  bool turned = false;
  double x_u = 0, x_y = 0, x_z = 0, x_0 = 0;
  double y_u = 0, y_v = 0, y_z = 0, y_0 = 0;
  double z_k = 0;                   // voxels along z from sample to sample of a ray; not 0
  double slide_x = 0, slide_y = 0;  // voxels along x and y from slice to slice on a ray; y_z is slide_y
};

// `start`: the place of (0, 0, 0) in voxels. `right`, `down` and `forward`: movements along a row and a column of the picture, and along a
// ray; they are linearly independent.
ShearPasses MakeShearPasses(const Vec3& start, const Vec3& right, const Vec3& down, const Vec3& forward);

}  // namespace slabstream::shear
