// Ball: points of the world at most `radius` from `centre`. Pictures frame one.
#pragma once

#include "common/math/vec.h"

namespace slabstream {

struct Ball {
  Vec3 centre;
  double radius = 1;  // > 0
  friend bool operator==(const Ball&, const Ball&) = default;
};

// The smallest ball that holds both.
inline Ball BallAround(const Ball& a, const Ball& b) {
  const double apart = Length(b.centre - a.centre);
  if (apart + b.radius <= a.radius) return a;
  if (apart + a.radius <= b.radius) return b;
  const double radius = 0.5 * (apart + a.radius + b.radius);
  return {a.centre + ((radius - a.radius) / apart) * (b.centre - a.centre), radius};
}

}  // namespace slabstream
