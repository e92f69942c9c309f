// Points along a line: where profiles are sampled.
#pragma once

#include <vector>

#include "common/math/vec.h"

namespace slabstream {

// `count` points, at least 2, at equal distances: the first is `from`, the last is `to`.
inline std::vector<Vec3> PointsAlong(const Vec3& from, const Vec3& to, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i + 1 < count; ++i) points.push_back(from + (double(i) / (count - 1)) * (to - from));
  points.push_back(to);
  return points;
}

}  // namespace slabstream
