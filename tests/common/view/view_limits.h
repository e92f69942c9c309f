// Limits of views, as the schema says them.
#pragma once

namespace slabstream {

inline constexpr double kMinZoom = 1e-3;
inline constexpr double kMinFovDegrees = 1, kMaxFovDegrees = 60;
inline constexpr double kMaxAngleDegrees = 1e6;  // of azimuth, elevation and roll, either sign

}  // namespace slabstream
