// An axis of a rectilinear grid, along which voxels are not evenly spaced.
//
// Pure. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/math/vec.h"
#include "common/mesh/mesh.h"

namespace slabstream {

struct UnevenAxis {
  std::vector<double> centres = {};  // of the voxels: two or more, strictly rising or falling; empty: the axis is even
  double begin = 0, end = 0;         // the voxels fill the axis from begin to end

  // Run backwards.
  UnevenAxis Reversed() const;
};
using UnevenAxes = std::array<UnevenAxis, 3>;

// `coordinates`: those of the voxels, the outer ones of which reach as far to both sides; or of the borders of cells, which are the voxels.
// InvalidArgument, naming `named` and a coordinate: they leave fewer than two voxels, do not all rise or all fall, or are not finite.
Result<UnevenAxis> UnevenAxisOf(const std::string& named, const std::vector<double>& coordinates, ValuesAt at);

// "the 97 voxels along z, 0.002 to 0.04 apart,". The axis is uneven and rises.
std::string DistancesText(const UnevenAxis& axis, Axis letter);

// How many even voxels fill the axis, none of them longer than the shortest distance of its own; perhaps more than a volume can have.
double VoxelsForShortest(const UnevenAxis& axis);

// Where the centres of `count` even voxels, which fill the axis, lie among its own: in [0, their number - 1]. The axis rises.
std::vector<double> EvenPlaces(const UnevenAxis& axis, std::int32_t count);

}  // namespace slabstream
