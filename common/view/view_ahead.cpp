#include "common/view/view_ahead.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace slabstream {
namespace {

// The same angle in [-180, 180].
double Wrapped(double degrees) { return std::remainder(degrees, 360); }

std::optional<Vec3> PointAhead(const std::optional<Vec3>& before, const std::optional<Vec3>& now, double steps) {
  if (!before || !now) return now;
  return *now + steps * (*now - *before);
}

std::optional<double> AngleAhead(const std::optional<double>& before, const std::optional<double>& now, double steps) {
  if (!before || !now) return now;
  return Wrapped(*now + steps * Wrapped(*now - *before));
}

}  // namespace

ViewParameters ViewAhead(const ViewParameters& before, const ViewParameters& now, double steps) {
  ViewParameters ahead = now;
  ahead.azimuth_degrees = AngleAhead(before.azimuth_degrees, now.azimuth_degrees, steps);
  ahead.elevation_degrees = AngleAhead(before.elevation_degrees, now.elevation_degrees, steps);
  ahead.roll_degrees = *AngleAhead(before.roll_degrees, now.roll_degrees, steps);
  ahead.zoom = std::min(now.zoom * std::pow(now.zoom / before.zoom, steps), kMaxZoom);
  ahead.look_at = PointAhead(before.look_at, now.look_at, steps);
  ahead.eye = PointAhead(before.eye, now.eye, steps);
  if (before.distance > 0 && now.distance > 0) ahead.distance = now.distance * std::pow(now.distance / before.distance, steps);
  return ahead;
}

}  // namespace slabstream
