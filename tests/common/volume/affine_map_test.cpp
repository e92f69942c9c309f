// Positions of one grid among the voxels of another one: the same point of the world, whatever the grids.
#include "common/volume/affine_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

// A grid that is turned about two axes.
VolumeGeometry RandomGrid(Random& random) {
  const double a = random.Real(-3, 3), b = random.Real(-1, 1), c = std::cos(a), s = std::sin(a), d = std::cos(b), t = std::sin(b);
  VolumeGeometry grid = {{int(random.Real(3, 90)), int(random.Real(3, 90)), int(random.Real(3, 90))},
                         {random.Real(0.1, 5), random.Real(0.1, 5), random.Real(0.1, 5)},
                         {World::kPatient, {random.Real(-300, 300), random.Real(-300, 300), random.Real(-300, 300)}}};
  grid.orientation.axes = {Vec3{c, s, 0}, Vec3{-s * d, c * d, t}, Vec3{s * t, -c * t, d}};
  return grid;
}

TEST(AffineMap, FindsTheSamePointOfTheWorld) {
  Random random(11);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 200; ++i) {
    const VolumeGeometry from = RandomGrid(random), to = RandomGrid(random);
    const AffineMap map = AffineMapBetween(from, to);
    for (int j = 0; j < 20; ++j) {
      const Vec3 p = {random.Real(-1, 90), random.Real(-1, 90), random.Real(-1, 90)};
      EXPECT_LT(Length(to.ToWorld(map.To(p)) - from.ToWorld(p)), 1e-4) << "mm";
    }
    EXPECT_TRUE(AffineMapBetween(from, from).is_identity());
  }
}

TEST(AffineMap, CoveringVoxelsHoldAllPositionsInTheBox) {
  Random random(12);
  SCOPED_TRACE(random.trace());
  int empty = 0;
  for (int i = 0; i < 300; ++i) {
    const VolumeGeometry from = RandomGrid(random);
    VolumeGeometry to = RandomGrid(random);
    to.orientation.origin = from.ToWorld(from.centre()) + Vec3{random.Real(-90, 90), random.Real(-90, 90), random.Real(-90, 90)};
    const AffineMap map = AffineMapBetween(from, to);
    const Box box = {{1, 0, 2}, from.size};
    const Box voxels = CoveringVoxels(box, map, to.size, 1);
    empty += voxels.empty() ? 1 : 0;
    EXPECT_TRUE(voxels.empty() || to.bounds().Contains(voxels));
    for (int j = 0; j < 50; ++j) {
      Vec3 p;
      for (const Axis axis : kAxes) p[axis] = random.Real(box.begin[axis] - 0.5, box.end[axis] - 0.5);
      const Vec3 q = map.To(p);
      const Index3 voxel = {int(std::floor(q.x + 0.5)), int(std::floor(q.y + 0.5)), int(std::floor(q.z + 0.5))};
      const Box one = {voxel, voxel + Uniform(1)};
      EXPECT_TRUE(!to.bounds().Contains(one) || voxels.Contains(one));
    }
  }
  EXPECT_GT(empty, 0) << "some grids lie elsewhere";
}

}  // namespace
}  // namespace slabstream
