// Unstructured and curvilinear grids as volumes: their values on a lattice, and their cells beside them.
//
// Any thread.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/volume_io/mesh_reader.h"
#include "data/volume_io/raw_volume.h"

namespace slabstream {

// How the reader of a grid is to read it. Whoever describes one takes the first component, unless there is a choice.
MeshOptions MeshOptionsOf(const ReadOptions& options);

// What VolumeFormat::read gives for the grid that was read with MeshOptionsOf(options). `path`: for errors. ResourceExhausted: it does not
// fit the memory.
Result<RawVolume> GridVolume(const std::string& path, LoadedMesh grid, const ReadOptions& options);

}  // namespace slabstream
