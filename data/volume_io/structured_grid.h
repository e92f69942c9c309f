// Structured grids of VTK as volumes: voxels are the grid's points, or its cells where the values belong to those.
//
// Pure. Any thread.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/mesh.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// Points along three axes.
struct PointGrid {
  std::array<double, 3> points = {1, 1, 1};  // as the file says: perhaps no whole numbers
  std::array<Vec3, 3> steps = StepsOf({1, 1, 1});
  Vec3 origin;                // the place of the first point
  std::string_view matrix{};  // RawHeader::matrix
  // Coordinates of the points along uneven axes, whose step is the mean one; empty: the axis is even.
  std::array<std::vector<double>, 3> uneven = {};
};

// Sets size and place of a volume whose voxels are at the points, or at the centres of the cells: a grid that is
// flat along an axis has one layer of them there. Errors of SetSize and UnevenAxisOf.
Status SetGrid(RawHeader& header, const std::string& path, const PointGrid& grid, ValuesAt at);

// The grid of points at these coordinates along x, y and z, at least one each; an axis with one point has the smallest spacing of the
// others. They are uneven if they are off by more than kMostUneven of the mean spacing and what rounding to float32 makes.
inline constexpr double kMostUneven = 0.01;
PointGrid GridOfCoordinates(const std::array<std::vector<double>, 3>& coordinates);

}  // namespace slabstream
