// Readers of single formats of unstructured grids: errors as in mesh_reader.h.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/mesh_reader.h"

namespace slabstream {

Result<std::vector<std::string>> FilesOfVtkXmlGrid(const std::string& path);
Result<LoadedMesh> ReadVtkXmlGrid(const std::string& path, const MeshOptions& options);
Result<LoadedMesh> ReadVtkLegacyGrid(const std::string& path, const MeshOptions& options);

}  // namespace slabstream
