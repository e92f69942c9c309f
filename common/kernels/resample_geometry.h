// What both forms of ResampleRows compute for a pixel of the picture.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/kernels/resample.h"

namespace slabstream {

struct ResamplePoint {
  bool seen = false;                // W > 0
  double x = 0, y = 0;              // in the frame
  double scale_x = 1, scale_y = 1;  // s of resample.h
};

// For the picture's point (x, y).
inline ResamplePoint ResampleAt(const ProjectiveMap& m, double x, double y) {
  const double w = m[6] * x + m[7] * y + m[8];
  if (!(w > 0)) return {};
  ResamplePoint point;
  point.seen = true;
  const double per_w = 1 / w;
  point.x = (m[0] * x + m[1] * y + m[2]) * per_w;
  point.y = (m[3] * x + m[4] * y + m[5]) * per_w;
  const auto scale = [&](double by_x, double by_y, double at) {
    const double dx = (by_x - at * m[6]) * per_w, dy = (by_y - at * m[7]) * per_w;
    return std::max(1.0, std::sqrt(dx * dx + dy * dy) - kSkewSlack);
  };
  point.scale_x = scale(m[0], m[1], point.x);
  point.scale_y = scale(m[3], m[4], point.y);
  return point;
}

// Places farther away, in pixels, count as outside the frame.
inline constexpr double kFarthestPlace = 1 << 29;
inline bool IsNear(double x, double y) { return std::abs(x) < kFarthestPlace && std::abs(y) < kFarthestPlace; }

// The quadratic B-spline.
inline double QuadraticSpline(double t) {
  t = std::abs(t);
  if (t >= 1.5) return 0;
  return t <= 0.5 ? 0.75 - t * t : 0.5 * (1.5 - t) * (1.5 - t);
}

// The sum of a spline's samples at the centres of all pixels. For wide splines it is the width, to within 3e-7 of it.
inline double SplineSum(double at, double scale) {
  constexpr double kWide = 64;
  if (scale > kWide) return scale;
  double sum = 0;
  for (double i = std::ceil(at - 1.5 * scale - 0.5); i <= at + 1.5 * scale - 0.5; ++i) sum += QuadraticSpline((i + 0.5 - at) / scale);
  return sum;
}

}  // namespace slabstream
