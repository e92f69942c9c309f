#include "common/volume/sphere.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {
namespace {

Volume Make(SphereClass sphere_class, int size, double occupancy) { return MakeSphere({sphere_class, size, occupancy}).value(); }

std::uint8_t At(const Volume& volume, int x, int y, int z) { return volume.block.samples<std::uint8_t>()[volume.block.Offset({x, y, z})]; }

// Squared distance of a voxel from the centre, in half voxels.
std::int64_t Distance(int n, int x, int y, int z) {
  const auto half = [&](int i) { return std::int64_t(2 * i - (n - 1)); };
  return half(x) * half(x) + half(y) * half(y) + half(z) * half(z);
}

template <class Visit>
void ForEachVoxel(int n, const Visit& visit) {
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) visit(x, y, z);
    }
  }
}

TEST(Sphere, HasTheOccupancyThatWasAskedFor) {
  for (const int n : {31, 50, 64, 101}) {
    // A shell of one distance holds about 2 pi N voxels, so the occupancy is met within that share of N^3.
    const double tolerance = 8.0 / (double(n) * n);
    for (const double occupancy : {0.03, 0.05, 0.07, 0.2}) {
      EXPECT_NEAR(MeasureOccupancy(Make(SphereClass::kHollow, n, occupancy)), occupancy, tolerance) << "hollow " << n;
    }
    for (const double occupancy : {0.01, 0.1, 0.4, 0.52}) {
      EXPECT_NEAR(MeasureOccupancy(Make(SphereClass::kFilled, n, occupancy)), occupancy, tolerance) << "filled " << n;
    }
  }
}

TEST(Sphere, IsWholeShellsOfEqualDistance) {
  for (const int n : {2, 3, 4, 5, 8, 17, 40}) {
    for (const SphereClass sphere_class : {SphereClass::kHollow, SphereClass::kFilled}) {
      const Volume volume = Make(sphere_class, n, 0.1);
      std::int64_t low = std::numeric_limits<std::int64_t>::max(), high = -1;
      ForEachVoxel(n, [&](int x, int y, int z) {
        if (At(volume, x, y, z) == 0) return;
        low = std::min(low, Distance(n, x, y, z));
        high = std::max(high, Distance(n, x, y, z));
      });
      ASSERT_GE(high, 0) << "nothing is occupied at size " << n;
      ForEachVoxel(n, [&](int x, int y, int z) {
        const std::int64_t distance = Distance(n, x, y, z);
        EXPECT_EQ(At(volume, x, y, z) != 0, distance >= low && distance <= high) << n << ": " << x << " " << y << " " << z;
      });
      if (sphere_class == SphereClass::kFilled) {
        EXPECT_LE(low, n % 2 == 0 ? 3 : 0) << "the centre is filled";
      }
      if (n < 8) continue;
      EXPECT_LE(high, std::int64_t(0.81 * n * n)) << "within 0.45 N";
      if (sphere_class == SphereClass::kHollow) {
        EXPECT_EQ(At(volume, n / 2, n / 2, n / 2), 0) << "hollow inside";
        EXPECT_GT(high, std::int64_t(0.81 * n * n) - 4 * n) << "reaches 0.45 N";
      }
    }
  }
}

TEST(Sphere, HasNoHolesWiderThanAVoxelAtTheUsualOccupancies) {
  // Along any ray from the centre an occupied voxel or a neighbour of one is met: walk many directions in steps of a tenth of a voxel.
  const int n = 64;
  for (const double occupancy : {0.03, 0.05, 0.07}) {
    const Volume volume = Make(SphereClass::kHollow, n, occupancy);
    const auto occupied_nearby = [&](int x, int y, int z) {
      bool occupied = false;
      for (int i = 0; i < 27; ++i) occupied = occupied || At(volume, x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1) != 0;
      return occupied;
    };
    for (int i = 0; i < 500; ++i) {
      const double z = -1 + (i + 0.5) / 250, radius = std::sqrt(1 - z * z), angle = i * 2.399963;  // golden-angle spiral
      bool met = false;
      for (double t = 0; t < 0.46 * n && !met; t += 0.1) {
        const auto voxel = [&](double d) { return int(std::floor((n - 1) / 2.0 + t * d + 0.5)); };
        met = occupied_nearby(voxel(radius * std::cos(angle)), voxel(radius * std::sin(angle)), voxel(z));
      }
      EXPECT_TRUE(met) << "direction " << i << " at occupancy " << occupancy;
    }
  }
}

TEST(Sphere, ValuesRiseAlongX) {
  const int n = 30;
  const Volume volume = Make(SphereClass::kFilled, n, 0.52);
  int before = 0;
  for (int x = 0; x < n; ++x) {
    const int value = At(volume, x, n / 2, n / 2);
    if (value == 0) continue;
    EXPECT_GE(value, 128);
    EXPECT_GE(value, before);
    EXPECT_EQ(value, At(volume, x, n / 2 + 2, n / 2 - 3)) << "the same all over a slice";
    before = value;
  }
  EXPECT_GT(before, 245);
}

TEST(Sphere, IsDeterministic) {
  EXPECT_EQ(Make(SphereClass::kHollow, 33, 0.04).block.bytes, Make(SphereClass::kHollow, 33, 0.04).block.bytes);
}

TEST(Sphere, RefusesWhatIsOutOfBounds) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const SphereRequest wrong[] = {
      {SphereClass::kHollow, 1, 0.05},  {SphereClass::kHollow, 4097, 0.05}, {SphereClass::kHollow, 64, 0.0009},
      {SphereClass::kHollow, 64, 0.31}, {SphereClass::kFilled, 64, 0},      {SphereClass::kFilled, 64, 0.53},
      {SphereClass::kFilled, 64, nan},  {SphereClass(3), 64, 0.1},
  };
  for (const SphereRequest& request : wrong) {
    const Status status = MakeSphere(request).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << request.size << " " << request.occupancy;
    EXPECT_THAT(status.message(), testing::ContainsRegex("(size|occupancy|class).* must be"));
  }
}

}  // namespace
}  // namespace slabstream
