// Where a view that moves will probably be.
#pragma once

#include "common/view/camera.h"

namespace slabstream {

// The view in which the movement from `before` to `now` goes on for `steps` times as long: angles, zoom by factors, and points. What either
// of both does not say stays as it is now.
ViewParameters ViewAhead(const ViewParameters& before, const ViewParameters& now, double steps);

}  // namespace slabstream
