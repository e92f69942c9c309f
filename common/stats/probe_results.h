// What a dataset holds at points and in boxes of its world: the answers to a client's questions (coordinator/probe).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/math/vec.h"
#include "common/volume/labels.h"

namespace slabstream {

// ---- at a point

struct LabelAt {
  std::uint64_t value = 0;  // as in the file; 0: none
  std::string name = {};    // "": none is known
  friend bool operator==(const LabelAt&, const LabelAt&) = default;
};

struct FieldSample {
  std::string name;                  // as people read it (TitleOf)
  std::optional<double> value = {};  // data value at the centre of the voxel; none: there is none here
  friend bool operator==(const FieldSample&, const FieldSample&) = default;
};

struct VolumeSample {
  Vec3 at;              // the point, of the world
  bool inside = false;  // the volume fills half a voxel beyond the centres of its outermost voxels; else nothing of what follows
  Index3 voxel = {};    // that holds the point
  std::optional<double> value = {};         // data value of the voxel; none: it is not finite
  std::optional<LabelAt> label = {};        // if the dataset has labels
  std::vector<FieldSample> fields = {};     // of all fields of values that were asked for, by their numbers
  std::optional<double> interpolated = {};  // data value at the point itself (ProbeVolume::Interpolated); none: not finite, or a label
  std::int64_t rest = 0;                    // of `value`, as of ExactValue
  friend bool operator==(const VolumeSample&, const VolumeSample&) = default;
};

// ---- in a box

struct BoxStatistics {
  std::uint64_t voxels = 0;      // finite ones whose centres lie in the box or on its sides
  std::uint64_t non_finite = 0;  // the others there
  // Of the data values of `voxels`; 0 if there are none.
  double mean = 0;
  double deviation = 0;  // standard deviation: the root of the mean squared difference from the mean
  double least = 0, largest = 0;
  friend bool operator==(const BoxStatistics&, const BoxStatistics&) = default;
};

struct LabelStatistics {
  Label label;
  BoxStatistics statistics;
  friend bool operator==(const LabelStatistics&, const LabelStatistics&) = default;
};

// ---- values and slopes together

inline constexpr int kJointValues = 128, kJointSlopes = 64;

// How often which value occurs together with which slope (the gradient's magnitude), for the editor of two-dimensional transfer functions
// (Kindlmann and Durkin 1998).
struct JointHistogram {
  double steepest = 0;  // the greatest slope counted: data values per unit of the world
  // [value][slope]: voxels in equal bins of values over the range of the volume, and of square roots of slopes up to the steepest.
  std::vector<std::uint64_t> counts = std::vector<std::uint64_t>(std::size_t{kJointValues} * kJointSlopes);
  friend bool operator==(const JointHistogram&, const JointHistogram&) = default;
};

}  // namespace slabstream
