// From a Zarr hierarchy to the levels of one volume (find_volume.h): those of an OME-Zarr image, or one array (plain_array.h).
//
// Positions of OME-Zarr are those of centres of voxels. If no level states a translation, the levels' first corners meet, since writers
// that leave it out average voxels.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/sources/read_context.h"
#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream::zarr {

// Errors: VolumeFormat::open. Waits.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream::zarr
