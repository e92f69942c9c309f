// A sparse test object for experiments on load balance: balls of one radius that lie dense near a corner of an N^3 volume of uint8, and
// that drift along x with time. Deterministic.
//
// The radius is chosen so that the share of occupied voxels is within a thousandth of the wanted occupancy, if whole voxels allow that.
// Occupied voxels hold 128 ... 255, rising along x, as in the spheres (common/volume/sphere.h); the rest holds 0.
#pragma once

#include <cstdint>

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

struct ClusterRequest {
  int size = 512;           // N, [8, 4096]
  double occupancy = 0.05;  // [0.001, 0.3]
  int balls = 24;           // [1, 1000]
  std::uint64_t seed = 1;   // the seed of their places
  double time = 0;          // [0, 1]: at 0 they lie dense near the corner of the first voxel, at 1 at the opposite end of x
  friend bool operator==(const ClusterRequest&, const ClusterRequest&) = default;
};

// InvalidArgument naming the field, the value and the limits.
Result<Volume> MakeClusters(const ClusterRequest& request);

}  // namespace slabstream
