// Unstructured and curvilinear grids of VTK.
#include <utility>

#include "data/volume_io/formats.h"
#include "data/volume_io/grid_volume.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  Result<LoadedMesh> grid = ReadMesh(path, MeshOptionsOf(options));
  return grid.ok() ? GridVolume(path, *std::move(grid), options) : grid.status();
}

}  // namespace

VolumeFormat UnstructuredGrid() {
  std::vector<std::string_view> endings(kXmlGridEndings.begin(), kXmlGridEndings.end());
  endings.emplace_back(".vtk");
  return {.name = "VTK unstructured grid",
          .endings = std::move(endings),
          .claims = LooksLikeMesh,
          .options = {"time", "channel", "array", "lattice"},
          .read = Read};
}

}  // namespace slabstream
