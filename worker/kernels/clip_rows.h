// Rows of rays against a convex clip region (worker/renderers/zbuffer/clip_rays.h): depths at which they enter and leave it, and the voxels
// that they are in at given depths. All in double precision without fused operations: the same bits on every instruction set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace slabstream {

// A quantity of the pixels of a row: at_0 + x * by_x at a pixel centre x.
struct LinearInRow {
  double at_0 = 0, by_x = 0;
};

// Values g that grow with the depth along a ray: the depth, or with perspective -1 / depth.
struct RegionRow {
  bool perspective = false;
  double start = 0, end = 0;                      // g at the depths 0 and kNeverMet
  std::vector<LinearInRow> entered, left, never;  // g of the sides that rays enter and leave; rays where a `never` is negative miss it
};

inline constexpr float kNeverMet = 1e30F;
inline constexpr std::size_t kRowPadding = 16;  // elements behind the last one that kernels may change

// The row's pixels column ... column + count - 1: the depths at which their rays are in the region, [enter, leave]. `enter` is 0 where a
// ray starts inside; rays that miss the region have kNeverMet and -1.
void RegionDepths(const RegionRow& row, std::int32_t column, std::size_t count, float* enter, float* leave);

// Data space, by axis: origin + depth * direction.
struct RayRow {
  std::array<LinearInRow, 3> origin, direction;
};

// The voxel whose cell each pixel's ray is in at depth[n] + behind; -1 or kMaxVolumeSide along an axis stand for all places before or
// behind every volume.
void VoxelsAt(const RayRow& row, std::int32_t column, std::size_t count, const float* depth, double behind, std::int32_t* x,
              std::int32_t* y, std::int32_t* z);

}  // namespace slabstream
