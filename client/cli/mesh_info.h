// `info` of unstructured grids: their cells, size and arrays.
#pragma once

#include "client/cli/options.h"
#include "common/base/status.h"

namespace slabstream {

// `options.path` ends as a grid's does (LooksLikeMesh).
Status RunMeshInfo(const InfoOptions& options);

}  // namespace slabstream
