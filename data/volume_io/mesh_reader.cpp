#include "data/volume_io/mesh_reader.h"

#include <algorithm>

#include "data/volume_io/mesh_formats.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_legacy_file.h"
#include "data/volume_io/vtk_list.h"

namespace slabstream {

bool LooksLikeMesh(const std::string& path) {
  const std::string name = ToLower(path);
  if (!name.ends_with(".vtk")) {
    return std::ranges::any_of(kXmlGridEndings, [&](std::string_view ending) { return name.ends_with(ending); }) && !ListsImages(path);
  }
  const std::optional<std::string> kind = VtkLegacyFile::KindOf(path);
  return kind == "UNSTRUCTURED_GRID" || kind == "STRUCTURED_GRID";
}

Result<std::vector<std::string>> FilesOfMesh(const std::string& path) {
  return VtkLegacyFile::KindOf(path) ? std::vector<std::string>{path} : FilesOfVtkXmlGrid(path);
}

Result<LoadedMesh> ReadMesh(const std::string& path, const MeshOptions& options) {
  return VtkLegacyFile::KindOf(path) ? ReadVtkLegacyGrid(path, options) : ReadVtkXmlGrid(path, options);
}

}  // namespace slabstream
