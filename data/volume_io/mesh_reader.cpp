#include "data/volume_io/mesh_reader.h"

#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_legacy_file.h"

namespace slabstream {

bool LooksLikeMesh(const std::string& path) {
  const std::string name = ToLower(path);
  return name.ends_with(".vtu") || (name.ends_with(".vtk") && VtkLegacyFile::KindOf(path) == "UNSTRUCTURED_GRID");
}

Result<LoadedMesh> ReadMesh(const std::string& path, const MeshOptions& options) {
  return VtkLegacyFile::KindOf(path) ? ReadVtkLegacyGrid(path, options) : ReadVtkXmlGrid(path, options);
}

}  // namespace slabstream
