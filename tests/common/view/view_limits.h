// Limits of views, as the schema says them, beside those of camera.h.
#pragma once

#include "common/view/camera.h"

namespace slabstream {

inline constexpr double kMaxAngleDegrees = 1e6;  // the limit of azimuth, elevation and roll, either sign

}  // namespace slabstream
