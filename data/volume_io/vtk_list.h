// Files of VTK's XML formats that name other files: pieces of a grid (.pvtu, .pvts), or blocks (.vtm, .vtpd, .vtpc), which are cells or
// images. Errors name the path. Any thread.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace slabstream {

inline constexpr std::size_t kMostListedFiles = 4096;
inline constexpr std::array<std::string_view, 4> kBlockListEndings = {".vtm", ".vtmb", ".vtpd", ".vtpc"};

struct VtkListEntry {
  std::string path;  // from the folder of the list
  std::string name;  // of the block, if it has one; else the file as the list names it
};

struct VtkList {
  std::string type;                   // "PUnstructuredGrid"
  std::vector<VtkListEntry> entries;  // none: it is no list, and no more was read of it than its type

  bool OfBlocks() const { return type.starts_with("vtk"); }
  bool OfSurfaces() const { return type == "PolyData" || type == "PPolyData"; }
};

// NotFound: no such file. InvalidArgument: a pipe or a folder, no XML file of VTK, a list of no files or of more than kMostListedFiles.
Result<VtkList> ReadVtkList(const std::string& path);

// The structured grids that are volumes of voxels, and the same in pieces.
inline constexpr std::array<std::string_view, 4> kVtkImageTypes = {"ImageData", "PImageData", "RectilinearGrid", "PRectilinearGrid"};
// Whether the first block of the file that is no surface has such a type. False, too: what is there cannot be read.
bool ListsImages(const std::string& path);

// What is noted of blocks that are surfaces, by their names.
std::string SurfacesNote(const std::vector<std::string>& names);

}  // namespace slabstream
