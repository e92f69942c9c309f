// Unstructured grids as files of VTK, written byte by byte from the format's definition.
#pragma once

#include <string>
#include <vector>

#include "tests/volume_io/more_files.h"

namespace slabstream {

struct VtuArray {
  std::string section, name;
  SampleType type = SampleType::kFloat32;
  int components = 1;
  std::vector<double> values;
};

struct VtuSpec {
  int points = 0, cells = 0;
  std::vector<VtuArray> arrays;  // in the order of their sections: PointData, CellData, Points, Cells
  std::string point_scalars, cell_scalars;
  bool big_endian = false;
};

// Of `options`: format, encoding, wide_header and block.
FileBytes VtuFile(const VtuSpec& spec, const VtiOptions& options = {});

// `types`: VTK's; `connectivity`: numbers of points, cell by cell. The values at the points are linear in their places: x + 10 y + 100 z.
VtuSpec GridSpec(const std::vector<Vec3>& points, const std::vector<int>& types, const std::vector<std::vector<int>>& connectivity);

// A cube of two wedges, a pyramid on top, and a tetrahedron beside them.
VtuSpec SmallGrid();

}  // namespace slabstream
