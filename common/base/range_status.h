// One wording for numbers out of range, so that every message names the field, the value and the limits.
#pragma once

#include <string_view>

#include "common/base/status.h"

namespace slabstream {

// Ok if min <= value <= max; else InvalidArgument such as "view.zoom is 0, but must lie in [0.001, 10000]". NaN is never in range.
Status InRange(std::string_view field, double value, double min, double max);

}  // namespace slabstream
