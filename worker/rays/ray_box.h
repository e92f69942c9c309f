// RayBox: one box for the ray kernels. Neither copies nor owns.
#pragma once

#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/view_rays.h"
#include "worker/renderers/padded_voxels.h"

namespace slabstream {

struct RayBox {
  ScalarType type = ScalarType::kUint8;
  const std::byte* samples = nullptr;  // of voxel origin - 1: PaddedVoxels::samples
  Index3 origin;                       // of the voxels' box, less 1: no sample has a floor below
  std::int32_t row = 0, slice = 0;     // samples from voxel to voxel along y and z
  Index3 cells;                        // MacrocellRanges::counts
  Float3 low{}, high{};                // the box owns the positions p with low <= p < high on every axis
  RayReach reach;                      // of the positions that may matter
  bool at_border = false;              // the box touches the volume's border
};

// The largest array of padded samples that kernels can address, in bytes.
inline constexpr std::size_t kMostRayBytes = (std::size_t{1} << 31) - 1;

// `box` lies in the box of the voxels. Samples of the box outside `sampled` need not be visited.
struct SampledRegion {
  Vec3 low, high;
};
RayBox MakeRayBox(const PaddedVoxels& voxels, const Index3& cells, const Box& box, const SampledRegion& sampled, const ViewRays& rays,
                  const Camera& camera);

// All positions that the box owns.
inline SampledRegion WholeBox(const Box& box) {
  const Vec3 half = {0.5, 0.5, 0.5};
  return {ToVec3(box.begin) - half, ToVec3(box.end) - half};
}

}  // namespace slabstream
