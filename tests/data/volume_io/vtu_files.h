// Unstructured grids as files of VTK, written byte by byte from the format's definition.
#pragma once

#include <string>
#include <vector>

#include "common/mesh/mesh.h"
#include "tests/data/volume_io/more_files.h"

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
  std::string extent = {};  // of a curvilinear grid (.vts), whose Cells are not written; "": an unstructured one
};

// Uses format, encoding, wide_header and block of `options`.
FileBytes VtuFile(const VtuSpec& spec, const VtiOptions& options = {});

struct LegacyOptions {
  bool binary = true;
  bool offsets = true;          // version 5.1: CELLS in two arrays; else version 3.0: each cell with its number of points
  bool metadata = true;         // behind each array
  std::string dimensions = {};  // of a curvilinear grid, whose cells are not written; "": an unstructured one
};
// The same grid as a legacy file. Arrays named by point_scalars and cell_scalars are SCALARS, others of three components VECTORS, and the
// rest is in a FIELD.
FileBytes LegacyGridFile(const VtuSpec& spec, const LegacyOptions& options = {});

// `types`: VTK's; `connectivity`: numbers of points, cell by cell. The values at the points are linear in their places: x + 10 y + 100 z.
VtuSpec GridSpec(const std::vector<Vec3>& points, const std::vector<int>& types, const std::vector<std::vector<int>>& connectivity);

// Hexahedra between the points of a lattice, from `begin` to `end` along each axis, both included, at the places that `place` gives them.
using PlacePoint = Vec3 (*)(const Vec3& number);
VtuSpec BoxOfHexahedra(const Index3& begin, const Index3& end, PlacePoint place);

// A file that names others: Sources of pieces, or files of blocks, as `type` ("PUnstructuredGrid", "vtkMultiBlockDataSet") has them.
FileBytes VtkListFile(const std::string& type, const std::vector<std::string>& files);

// A cube of two wedges, a pyramid on top, and a tetrahedron beside them.
VtuSpec SmallGrid();

// Of all tetrahedra.
double VolumeOf(const Mesh& mesh);

}  // namespace slabstream
