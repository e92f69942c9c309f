// Files of VTK's XML formats that name other files: pieces of a grid (.pvtu, .pvts), or blocks (.vtm, .vtpd, .vtpc). Errors name the path.
// Any thread.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

inline constexpr std::size_t kMostListedFiles = 4096;

struct VtkListEntry {
  std::string path;  // from the folder of the list
  std::string name;  // of the block, if it has one; else the file as the list names it
};

struct VtkList {
  std::string type;                   // "PUnstructuredGrid"
  std::vector<VtkListEntry> entries;  // none: it is no list, and no more was read of it than its type

  bool OfBlocks() const { return type.starts_with("vtk"); }
};

// NotFound: no such file. InvalidArgument: a pipe or a folder, no XML file of VTK, a list of no files or of more than kMostListedFiles.
Result<VtkList> ReadVtkList(const std::string& path);

}  // namespace slabstream
