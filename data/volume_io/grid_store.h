// Grids that may not fit the memory. The cells of those that do not are kept in the cache folder, in a cell store (data/cell_store), beside
// brick stores (common/files/store_folder.h). It belongs to one state of the files and to the options by which they are read.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "data/cell_store/stored_cells.h"
#include "data/volume_io/mesh_reader.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct StoredGrid {
  std::shared_ptr<StoredCells> cells;              // never null; the store is in use as long as they are there
  std::vector<std::filesystem::path> other_files;  // beside the path
};
using Grid = std::variant<LoadedMesh, StoredGrid>;

// How the grids of a format are read.
struct GridFormat {
  std::function<Result<std::vector<std::string>>()> files;     // the path, and the files that it names
  std::function<Result<LoadedMesh>(const MeshOptions&)> read;  // errors of ReadMesh; perhaps called several times
};

// VTK's (mesh_reader.h).
GridFormat VtkGrid(const std::string& path);

// Of a component that nobody chooses it is the first one, if options.describe.
MeshOptions MeshOptionsOf(const ReadOptions& options);

// Reads a grid. Its cells are stored if points and tetrahedra, as they are read, take more than a quarter of the available memory, or if
// options.keep_cells; a store that is there is used in any case. If another process makes the same store, this waits for it. If there is no
// cache folder, the grid must fit the memory. options.progress counts bytes of files that are read, and as many for making a store.
// Errors of GridFormat::read, StoreCells and StoreFolder. Unavailable: there is no room, in one line that says how many bytes are needed;
// or the files change meanwhile. Any thread.
Result<Grid> ReadGrid(const std::string& path, const ReadOptions& options, const GridFormat& format);

}  // namespace slabstream
