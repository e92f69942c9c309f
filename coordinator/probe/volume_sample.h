// VolumeSample: what a dataset holds at a point of its world.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/math/vec.h"

namespace slabstream {

struct LabelAt {
  std::uint32_t value = 0;  // the label's number in the file; 0: none
  std::string name = {};    // "": none is known
  friend bool operator==(const LabelAt&, const LabelAt&) = default;
};

struct VolumeSample {
  Vec3 at;              // the point, of the world
  bool inside = false;  // the volume fills half a voxel beyond the centres of its outermost voxels; else nothing of what follows
  Index3 voxel = {};    // the voxel that holds the point
  std::optional<double> value = {};         // data value of the voxel; none: it is not finite
  std::optional<LabelAt> label = {};        // if the dataset has labels
  std::optional<double> overlay = {};       // data value of its overlay; none: there is none here
  std::optional<double> interpolated = {};  // data value at the point itself, trilinear (ProbeVolume::Interpolated); none: it is not finite
  std::int64_t rest = 0;                    // what `value` leaves out, as in ExactValue
  friend bool operator==(const VolumeSample&, const VolumeSample&) = default;
};

}  // namespace slabstream
