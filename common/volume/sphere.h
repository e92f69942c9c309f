// The paper's two test objects (Yagel and Machiraju, section 4), as N^3 volumes of uint8. Deterministic.
//
// Class I: a hollow sphere, all voxels between two radii. Class II: all voxels within a radius. The outer radius of class I is 0.45 N; the
// other radius is chosen so that the share of occupied voxels is as near to the wanted occupancy as whole shells of voxels at equal
// distance from the centre allow. Occupied voxels hold 128 ... 255, rising along x; the rest holds 0.
#pragma once

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

enum class SphereClass { kHollow = 1, kFilled = 2 };

struct SphereRequest {
  SphereClass sphere_class = SphereClass::kHollow;
  int size = 256;           // N, [2, 4096]
  double occupancy = 0.05;  // class I: [0.001, 0.3], usual 0.03 ... 0.07 (sets the shell's thickness); class II: (0, 0.52]
};

// InvalidArgument naming the field, the value and the limits.
Result<Volume> MakeSphere(const SphereRequest& request);

double MeasureOccupancy(const Volume& volume);  // share of voxels whose stored sample is not 0

}  // namespace slabstream
