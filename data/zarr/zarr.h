// Zarr, versions 2 and 3, in folders and zip archives: OME-Zarr images with their levels, and plain arrays.
//
//   scan.ome.zarr      scan.ome.zarr/labels/cells      scan.ozx?array=labels/cells      simulation.zarr?array=density,time=3
#pragma once

#include "data/sources/source_format.h"

namespace slabstream {

SourceFormat Zarr();

}  // namespace slabstream
