// The arrays of a file of a grid (VTK's), and which of them is read.
//
// Pure. Any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/mesh.h"
#include "data/volume_io/sample_type.h"

namespace slabstream {

struct GridArray {
  std::string name;
  ValuesAt at = ValuesAt::kPoints;
  std::optional<SampleType> type = SampleType::kFloat32;  // none: it is not supported
  std::string type_name = {};                             // as the file calls it
  int components = 1;
  bool active = false;  // the file says that it is the one to show

  std::string TypeText() const { return type ? std::string(ToString(*type)) : type_name; }
};

// Those of a file, and their numbers in a list of the file's reader, which may hold more.
struct OfferedArrays {
  std::vector<GridArray> arrays;
  std::vector<std::size_t> numbers;
};

// The number of the one that is read. `wanted` names it, "": nobody does; of two with one name, it is that of points. Without a name it is
// the active one, that of points first; else the only one of points, or if they have none of cells, where those with one component are
// looked at first, and none whose name begins with vtk, which are VTK's own. InvalidArgument, naming `path` and the arrays: there is none,
// it is not clear which, or it has a type that is not supported.
Result<std::size_t> ChooseArray(const std::string& path, const std::vector<GridArray>& arrays, const std::string& wanted);

// What readers of volumes note of the choice (RawHeader::notes): which array of several it is, and that its values belong to cells.
std::vector<std::string> NotesOf(const std::vector<GridArray>& arrays, std::size_t chosen);

}  // namespace slabstream
