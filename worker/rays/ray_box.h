// RayBox: one box for the ray kernels. Neither copies nor owns.
#pragma once

#include "common/volume/grid_map.h"
#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/view_rays.h"
#include "worker/renderers/padded_voxels.h"

namespace slabstream {

struct StretchTables;  // worker/rays/stretch_tables.h

struct RayBox {
  ScalarType type = ScalarType::kUint8;
  const std::byte* samples = nullptr;      // points to voxel origin - 1: PaddedVoxels::samples
  Index3 origin;                           // the origin of the voxels' box, less 1: no sample has a floor below
  Index3 padded;                           // voxels that have samples, along each axis
  std::int32_t row = 0, slice = 0;         // samples from voxel to voxel along y and z
  Index3 cells;                            // MacrocellRanges::counts
  Float3 low{}, high{};                    // the box owns the positions p of the frame with low <= p < high on every axis
  Float3 scale{1, 1, 1}, offset{};         // p lies at scale * p + offset among the voxels
  RayReach reach;                          // the reach of the positions that may matter
  bool at_border = false;                  // the box touches the volume's border
  const StretchTables* stretch = nullptr;  // of a rectilinear grid, whose scale is 1 and whose offset 0
};

// The largest array of padded samples that kernels can address, in bytes.
inline constexpr std::size_t kMostRayBytes = (std::size_t{1} << 31) - 1;

// Positions p with low <= p < high on every axis.
struct SampledRegion {
  Vec3 low, high;
};
// All positions that a box owns; of a rectilinear grid, in voxel coordinates.
inline SampledRegion WholeBox(const Box& box) {
  const Vec3 half = {0.5, 0.5, 0.5};
  return {ToVec3(box.begin) - half, ToVec3(box.end) - half};
}
// A region of voxel coordinates, in data space.
inline SampledRegion InDataSpace(const SampledRegion& region, const Stretch& stretch) {
  return {stretch.ToData(region.low), stretch.ToData(region.high)};
}
inline constexpr SampledRegion kEverywhere = {{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}};

// What kernels read of voxels. Positions and reach are left out.
RayBox BoxOfVoxels(const PaddedVoxels& voxels, const Index3& cells);

// `owned`: positions of the frame, which lie in the box of the voxels. `map`: from them to positions among the voxels. Samples outside
// `sampled`, of positions among the voxels, need not be visited.
RayBox MakeRayBox(const PaddedVoxels& voxels, const Index3& cells, const SampledRegion& owned, const SampledRegion& sampled,
                  const ViewRays& rays, const Camera& camera, const GridMap& map = {});

}  // namespace slabstream
