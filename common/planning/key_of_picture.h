// What the colours of a picture mean. Pure.
#pragma once

#include "common/classification/picture_key.h"
#include "common/planning/resolved_request.h"

namespace slabstream {

// A bar for each field of values that shows and whose colours differ by value, in the order of the fields. Entries are the labels that are
// shown, those without a name by their number, and then the isosurfaces by their values.
PictureKey KeyOf(const ResolvedRequest& request);

}  // namespace slabstream
