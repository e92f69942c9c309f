// Local images that are equal to the last bit.
#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "common/image/local_image.h"

namespace slabstream {

// No float is printed: there are too many.
inline void ExpectSameBits(const LocalImage& a, const LocalImage& b) {
  const auto same = []<class Vector>(const Vector& one, const Vector& other) {
    return one.size() == other.size() && (one.empty() || std::memcmp(one.data(), other.data(), one.size() * sizeof(one[0])) == 0);
  };
  EXPECT_EQ(a.bounds, b.bounds);
  EXPECT_TRUE(same(a.rgba, b.rgba));
  EXPECT_TRUE(same(a.depth, b.depth));
  EXPECT_TRUE(same(a.voxel, b.voxel));
}

}  // namespace slabstream
