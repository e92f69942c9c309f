// Points that are equal up to rounding.
#pragma once

#include <gtest/gtest.h>

#include "common/math/vec.h"

namespace slabstream {

inline void ExpectNear(const Vec3& a, const Vec3& b, double tolerance) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(a[i], b[i], tolerance) << a.x << "," << a.y << "," << a.z << " and " << b.x << "," << b.y << "," << b.z;
  }
}

}  // namespace slabstream
