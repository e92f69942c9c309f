// Unstructured and curvilinear grids as volumes: their values on a lattice, and their cells beside them, or if they do not fit the memory
// in a cell store (grid_store.h).
//
// Any thread.
#pragma once

#include <string>

#include "common/base/status.h"
#include "data/volume_io/grid_store.h"
#include "data/volume_io/raw_volume.h"
#include "data/volume_io/read_options.h"

namespace slabstream {

// What VolumeFormat::read gives for the grid at `path`. Errors of ReadGrid; ResourceExhausted: it does not fit the memory.
Result<RawVolume> GridVolume(const std::string& path, const ReadOptions& options, const GridFormat& format);

}  // namespace slabstream
