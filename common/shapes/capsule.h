// Capsule: the hull of two balls, which a piece of a line is; of one ball, which a point is. Its surface is the envelope of the balls with
// centre a + s (b - a) and radius r_a + s (r_b - r_a), s in [0, 1].
#pragma once

#include <cmath>
#include <limits>

#include "common/math/vec.h"

namespace slabstream {

struct Capsule {
  Vec3 a, b;
  double radius_a = 0, radius_b = 0;

  struct Hit {
    double along = std::numeric_limits<double>::infinity();  // of the ray: origin + along * direction; infinity: it misses
    double s = 0;
  };
  // The first of the two points where the line meets the surface.
  //
  // With p from a, e = b - a, r = radius_b - radius_a: p lies in the ball s if F(p, s) = |p - s e|^2 - (radius_a + s r)^2 <= 0. F is least
  // for s = (e.p + radius_a r) / d with d = e.e - r^2, and 0 there on the cone d (|p|^2 - radius_a^2) = (e.p + radius_a r)^2: quadratic
  // along a line. Where that s lies beyond the ends, the ball of that end is met.
  Hit FirstOn(const Vec3& origin, const Vec3& direction) const {
    const Vec3 e = b - a, p = origin - a;
    const double r = radius_b - radius_a, d = Dot(e, e) - r * r, square = Dot(direction, direction);
    if (d > 0) {
      const double y = Dot(e, p) + radius_a * r, slope = Dot(e, direction);
      const double qa = d * square - slope * slope, qb = d * Dot(p, direction) - y * slope,
                   qc = d * (Dot(p, p) - radius_a * radius_a) - y * y;
      const double root = qb * qb - qa * qc;
      if (root < 0) return {};
      const double along = (-qb - std::sqrt(root)) / qa, s = (y + along * slope) / d;
      if (s >= 0 && s <= 1) return {along, s};
    }
    const auto ball = [&](const Vec3& from, double radius) {
      const double half = Dot(from, direction), root = half * half - square * (Dot(from, from) - radius * radius);
      return root < 0 ? std::numeric_limits<double>::infinity() : (-half - std::sqrt(root)) / square;
    };
    const double at_a = ball(p, radius_a), at_b = ball(origin - b, radius_b);
    return at_a <= at_b ? Hit{at_a, 0} : Hit{at_b, 1};
  }
  // At origin + along * direction of a hit; not of unit length.
  Vec3 NormalAt(const Vec3& point, double s) const { return point - a - s * (b - a); }
};

}  // namespace slabstream
