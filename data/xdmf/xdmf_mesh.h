// Unstructured and curvilinear grids of an XDMF file: points anywhere in space, and cells between them.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "data/volume_io/mesh_reader.h"
#include "data/xdmf/xdmf_document.h"
#include "data/xdmf/xdmf_item.h"

namespace slabstream {

// Whether a uniform grid has such a topology. Errors of XdmfDocument::Needed.
Result<bool> IsXdmfMesh(XdmfDocument& document, const XdmfElement& grid);

// The XDMF file and those in which the numbers of the pieces are. Errors of ReadXdmfMesh.
Result<std::vector<std::string>> FilesOfXdmfMesh(XdmfDocument& document, const std::vector<const XdmfElement*>& pieces, XdmfArrays& arrays);

// The uniform grids `pieces`, at least one, as one grid. Cells are in VTK's order of points, as the programs that read XDMF take them.
// Errors of ReadMesh (mesh_reader.h). Waits.
Result<LoadedMesh> ReadXdmfMesh(XdmfDocument& document, const std::vector<const XdmfElement*>& pieces, const MeshOptions& options,
                                XdmfArrays& arrays);

}  // namespace slabstream
