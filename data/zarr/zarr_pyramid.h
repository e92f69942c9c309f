// From a Zarr hierarchy to the levels of one volume.
//
// A group that is no image opens its only array, or the first image that bioformats2raw wrote; ReadOptions::array takes another one.
//
// Axes of plain arrays: x, y, z, t (time) and c (channel) if dimension_names or xarray's _ARRAY_DIMENSIONS call them so; else the last
// three are z, y and x, and two before them are time and channel; one before them is time, or the channel if the options take one.
//
// Positions of OME-Zarr are those of centres of voxels. If no level states a translation, the levels' first corners meet, since writers
// that leave it out average voxels.
#pragma once

#include <memory>

#include "common/base/status.h"
#include "data/sources/chunked_source.h"
#include "data/sources/source_format.h"
#include "data/stores/store.h"
#include "data/volume_io/read_options.h"

namespace slabstream::zarr {

// Errors: SourceFormat::open. Waits.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context);

}  // namespace slabstream::zarr
