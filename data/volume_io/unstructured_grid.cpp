// Unstructured and curvilinear grids of VTK.
#include <string_view>
#include <utility>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/grid_volume.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {
namespace {

Result<RawVolume> Read(const std::string& path, const ReadOptions& options) { return GridVolume(path, options, VtkGrid(path)); }

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
