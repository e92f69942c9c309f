// What rectilinear grids hold at points of the world, and which point a pixel shows.
#include "coordinator/probe/probe_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "coordinator/probe/pick.h"
#include "tests/support/random.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

constexpr Index3 kSize = {12, 9, 15};

VolumeGeometry RandomGrid(Random& random) {
  VolumeGeometry grid{.size = kSize, .spacing = {0.5, 2, 1}, .orientation = {.world = World::kScene, .origin = {3, -7, 100}}};
  Stretch::Places places;
  for (const Axis axis : kAxes) {
    std::vector<double>& its = places[std::size_t(Number(axis))];
    double at = 0;
    for (int i = 0; i < kSize[axis]; ++i) its.push_back(at += random.Real(0.05, 2));
    const double end = at + random.Real(0.05, 2);
    for (double& place : its) place = place / end * kSize[axis] - 0.5;
  }
  grid.stretch = Stretch::Make(places, kSize).value();
  return grid;
}

// A function that is linear along each axis is what lies between its own values.
TEST(ProbeVolume, PointsOfARectilinearGridLieBetweenItsOwnVoxels) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int round = 0; round < 20; ++round) {
    const VolumeGeometry grid = RandomGrid(random);
    const auto value = [](const Vec3& at) {
      return 5 + 0.25 * at.x - 2 * at.y + 0.5 * at.z + 0.125 * at.x * at.y - 0.01 * at.x * at.y * at.z;
    };
    const auto world = [&](const Vec3& voxel) { return grid.ToWorld(grid.stretch.ToData(voxel)); };
    const Volume volume = MakeVolume(grid, ScalarType::kFloat32, [&](const Index3& v) { return value(world(ToVec3(v))); });
    const VolumeSummary summary = Summarize(volume);
    for (int i = 0; i < 50; ++i) {
      const Vec3 voxel = {random.Real(0, 11), random.Real(0, 8), random.Real(0, 14)};
      const VolumeSample sample = SampleAt({.voxels = VoxelBricks(volume.block)}, summary, world(voxel));
      ASSERT_TRUE(sample.inside);
      EXPECT_EQ(sample.voxel, (Index3{int(voxel.x + 0.5), int(voxel.y + 0.5), int(voxel.z + 0.5)}));
      EXPECT_NEAR(sample.interpolated.value(), value(world(voxel)), 1e-4);
    }
  }
}

// Where a value that falls towards both walls passes the one from which on it is opaque: in thin voxels near a wall.
TEST(Pick, FindsThinLayersOfARectilinearGrid) {
  VolumeGeometry grid{.size = {8, 40, 8}};
  Stretch::Places places;
  for (int i = 0; i < 40; ++i) places[1].push_back(20 * std::tanh(3 * (i - 19.5) / 20) / std::tanh(3.0) + 19.5);
  grid.stretch = Stretch::Make(places, grid.size).value();
  const Volume volume = MakeVolume(grid, ScalarType::kFloat32, [](const Index3& v) { return v.y == 1 ? 200 : 0; });
  SetupOptions options{.renderer = FindRenderer("raycast"), .view = {.azimuth_degrees = 0, .elevation_degrees = 0}};
  options.transfer.colors = {{0, {1, 1, 1}}};
  options.transfer.opacities = {{100, 0}, {101, 1}};
  const FrameSetup setup = MakeSetup(volume, options);
  const auto picked = Pick(setup, {.voxels = VoxelBricks(volume.block)}, 32, 32);
  ASSERT_TRUE(picked);
  EXPECT_NEAR(picked->at.y, grid.stretch.ToData(0.5, Axis::kY), 0.25 * grid.least_distance());
}

}  // namespace
}  // namespace slabstream
