// Files of unstructured and curvilinear grids to meshes: VTK's XML files (.vtu, .vts) in any encoding (vtk_xml.h), and lists of them
// (.pvtu, .pvts, .vtm; vtk_list.h), whose pieces become one grid; legacy VTK files (.vtk) of versions 1 to 5, ASCII or binary. Tetrahedra,
// hexahedra, voxels, wedges and pyramids are read; cells without a volume are counted and left out, those that VTK marks as ghosts
// (mesh_builder.h) are left out. Hexahedra, wedges and pyramids are split (common/mesh/cells.h), so that the value is linear in each part,
// not trilinear in the cell.
//
// All functions may be called from any thread.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/lattice.h"
#include "common/mesh/mesh.h"
#include "data/cell_store/cell_spool.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

struct MeshFileInfo {
  std::string format;  // "VTK unstructured grid, legacy", "VTK PUnstructuredGrid, 4 files"
  std::int64_t points = 0, cells = 0;
  struct CellCount {
    const CellKind* kind = nullptr;
    std::int64_t count = 0;
  };
  std::vector<CellCount> kinds;                         // the kinds that occur, in the order of CellKinds()
  std::vector<GridArray> arrays;                        // in the file's order
  std::size_t array = 0;                                // the one that is read, of `arrays`
  std::optional<int> channel{};                         // the component that is read: that of MeshOptions
  std::vector<std::string> notes = {};                  // a sentence each of what was left out: SourceInfo
  std::vector<std::filesystem::path> other_files = {};  // that were read beside the path
};

// Where a grid goes that does not fit the memory, piece by piece.
struct MeshSpill {
  std::uint64_t most_bytes = 0;              // of points and tetrahedra as they are read, that may be in memory after a piece
  std::function<Result<CellSpool>()> begin;  // called once, when there are more
};

struct LoadedMesh {
  MeshFileInfo info;
  Bounds3 bounds;                              // the bounds of the points, in the world
  Mesh mesh;                                   // its points are in the world, from bounds.low; empty if they are in the spool
  std::shared_ptr<CellSpool> spool = nullptr;  // null: they are in memory
};

struct MeshOptions {
  // ReadOptions::array and time.
  std::string array;
  std::optional<TimeRange> time = {};
  std::optional<int> channel = {};
  // Checks what can be checked without points, cells and values; the mesh has none then, and no bounds.
  bool headers_only = false;
  const MeshSpill* spill = nullptr;                   // null: the grid must fit the memory
  std::function<void(std::int64_t bytes)> read = {};  // told the bytes of each file that was read; null: nobody asks
};

inline constexpr std::array<std::string_view, 8> kXmlGridEndings = {".vtu", ".pvtu", ".vts", ".pvts", ".vtm", ".vtmb", ".vtpd", ".vtpc"};

// `path`, and the files that it names. Errors of ReadVtkList, and of lists that are no grids.
Result<std::vector<std::string>> FilesOfMesh(const std::string& path);

// By its ending; a legacy VTK file by what it says of its dataset, and not a list of images (ListsImages).
bool LooksLikeMesh(const std::string& path);

// NotFound (no such file), InvalidArgument (no unstructured grid, no such array, cells of another kind, a point that is not finite),
// DataLoss (truncated, damaged, cells of points that there are not), ResourceExhausted (does not fit the memory). Messages name the path.
// Errors of `options.spill`.
Result<LoadedMesh> ReadMesh(const std::string& path, const MeshOptions& options = {});

}  // namespace slabstream
