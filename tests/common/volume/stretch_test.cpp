// Where voxels of rectilinear grids lie.
#include "common/volume/stretch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/volume/volume.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kSeed = 11;

// Steps differ by up to e^3.
std::vector<double> RandomPlaces(int size, Random& random) {
  std::vector<double> ends = {0};
  for (int i = 0; i <= size; ++i) ends.push_back(ends.back() + std::exp(random.Real(-1.5, 1.5)));
  std::vector<double> places;
  for (int i = 1; i <= size; ++i) places.push_back(ends[std::size_t(i)] / ends.back() * size - 0.5);
  return places;
}

TEST(StretchTest, VoxelCoordinatesArePiecewiseLinearAndInvertible) {
  Random random(kSeed);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 50; ++round) {
    const int size = random.Integer(2, 40);
    const std::vector<double> places = RandomPlaces(size, random);
    const Stretch stretch = Stretch::Make({{{}, places, {}}}, {3, size, 5}).value();
    EXPECT_NEAR(stretch.ToData(-0.5, Axis::kY), -0.5, 1e-12);
    EXPECT_NEAR(stretch.ToData(size - 0.5, Axis::kY), size - 0.5, 1e-12);
    for (int i = 0; i < size; ++i) EXPECT_DOUBLE_EQ(stretch.ToData(i, Axis::kY), places[std::size_t(i)]);
    for (int i = 0; i + 1 < size; ++i) {
      const double t = random.Real(0, 1);
      EXPECT_NEAR(stretch.ToData(i + t, Axis::kY), std::lerp(places[std::size_t(i)], places[std::size_t(i) + 1], t), 1e-9);
    }
    for (int i = 0; i < 100; ++i) {
      const double position = random.Real(-2, size + 1);
      const Vec3 there = stretch.ToData(stretch.ToVoxel(Vec3{7, position, -3}));
      EXPECT_EQ(there.x, 7);
      EXPECT_NEAR(there.y, position, 1e-9);
      EXPECT_EQ(there.z, -3);
    }
  }
}

TEST(StretchTest, AnEvenGridHasNone) {
  const Stretch stretch = Stretch::Make({{{0, 1, 2}, {}, {0, 1}}}, {3, 4, 2}).value();
  EXPECT_TRUE(stretch.even());
  EXPECT_EQ(stretch, Stretch());
  EXPECT_EQ(stretch.ToVoxel(0.3, Axis::kX), 0.3);
  EXPECT_NE(Stretch::Make({{{0, 1.5, 2}, {}, {}}}, {3, 4, 2}).value(), stretch);
}

TEST(StretchTest, RefusesPlacesThatDoNotRiseInTheVolume) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto why = [](const std::vector<double>& places) { return Stretch::Make({{{}, {}, places}}, {1, 1, 3}).status().message(); };
  EXPECT_THAT(why({0, 1}), HasSubstr("along z, 2 places of 3 voxels"));
  for (const std::vector<double>& places : {std::vector<double>{0, 2, 1}, {0, 1, 1}, {0, 1, 1 + 1e-6}, {0, kNan, 1}}) {
    EXPECT_THAT(why(places), HasSubstr("along z, place ")) << places[1] << ' ' << places[2];
  }
  EXPECT_THAT(why({-0.5, 1, 2}), HasSubstr("place 0 is -0.5, must lie 1e-05 or more above the one before and below 2.5"));
  EXPECT_THAT(why({0, 1, 2.5}), HasSubstr("place 2 is 2.5"));
  EXPECT_THAT(why({0, 1, 1e300}), HasSubstr("place 2 is 1e+300"));
}

TEST(VolumeGeometryTest, BoxesOfDataSpaceHoldTheirVoxels) {
  Random random(kSeed);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 50; ++round) {
    VolumeGeometry geometry{.size = {random.Integer(2, 30), random.Integer(2, 30), random.Integer(2, 30)}};
    EXPECT_EQ(geometry.InDataSpace(geometry.bounds()), geometry.bounds());
    geometry.stretch =
        Stretch::Make({{RandomPlaces(geometry.size.x, random), {}, RandomPlaces(geometry.size.z, random)}}, geometry.size).value();
    EXPECT_EQ(geometry.InDataSpace(geometry.bounds()), geometry.bounds());
    Box box;
    for (const Axis axis : kAxes) {
      box.begin[axis] = random.Integer(0, geometry.size[axis] - 1);
      box.end[axis] = random.Integer(box.begin[axis] + 1, geometry.size[axis]);
    }
    const Box held = geometry.InDataSpace(box);
    for (const Axis axis : kAxes) {
      EXPECT_LE(held.begin[axis] - 0.5, geometry.stretch.ToData(box.begin[axis] - 0.5, axis) + 1e-6);
      EXPECT_GE(held.end[axis] - 0.5, geometry.stretch.ToData(box.end[axis] - 0.5, axis) - 1e-6);
    }
    EXPECT_TRUE(geometry.bounds().Contains(held));
  }
}

}  // namespace
}  // namespace slabstream
