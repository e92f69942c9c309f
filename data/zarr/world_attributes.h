// What `slabstream convert` keeps of a volume in attributes of its own, since OME-Zarr has no place for it: the world, its axes, and the
// mapping to data values. data/zarr_writer/ome_metadata.h says what they are.
#pragma once

#include "common/base/status.h"
#include "data/metadata/json_fields.h"
#include "data/sources/chunked_source.h"

namespace slabstream::zarr {

// `own`: the attribute "slabstream" of an image; not stated: nothing changes. `pyramid`: its origins are positions in the coordinate system
// of the image; they become positions in the world. InvalidArgument, naming the field: it is wrong.
Status PlaceInWorld(const metadata::Field& own, Pyramid& pyramid);

}  // namespace slabstream::zarr
