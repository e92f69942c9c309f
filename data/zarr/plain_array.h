// An array without OME-Zarr as a volume: its axes by their names or their order, its place by coordinates that lie beside it, and its
// values by the CF conventions.
//
// Axes: those that dimension_names or xarray's _ARRAY_DIMENSIONS call so (axis_kind.h); of the others the last ones are x, y and z as far
// as these are missing, and two before them are time and channel; one before them is time, or the channel if the options take one.
//
// Values: scale_factor * stored + add_offset, and NaN where _FillValue or missing_value is stored (https://cfconventions.org, 2.5.1
// and 8.1).
#pragma once

#include "common/base/status.h"
#include "data/sources/axis_choice.h"
#include "data/sources/chunked_source.h"
#include "data/volume_io/read_options.h"
#include "data/zarr/zarr_array.h"
#include "data/zarr/zarr_node.h"

namespace slabstream::zarr {

// Notes say what was chosen. `node` is an array. Errors of OpenArray, KindsOfPlainAxes, ChooseAxes and of reading coordinates;
// InvalidArgument,
// naming the field: it is wrong. Waits.
Result<Pyramid> PyramidOfArray(const ArrayContext& context, const ZarrNode& node, const ReadOptions& options);

// A level of the axes of the metadata, as those of the array.
PyramidLevel LevelOf(const ZarrArray& array, const ChosenAxes& choice);
std::vector<std::uint64_t> SizesInMetadata(const ZarrArray& array);

}  // namespace slabstream::zarr
