// Layers on the grid of another volume: the same world point has the same label, whatever the grids.
#include "data/layers/layer_sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/random_volume.h"

namespace slabstream {
namespace {

VolumeGeometry Placed(const Index3& size, const Vec3& spacing, const Vec3& origin, double turn = 0) {
  const double c = std::cos(turn), s = std::sin(turn);
  return {size, spacing, {World::kPatient, origin, {Vec3{c, s, 0}, Vec3{-s, c, 0}, Vec3{0, 0, 1}}}};
}

Vec3 WorldOf(const VolumeGeometry& g, const Index3& v) { return g.orientation.origin + g.orientation.ToWorld(ToVec3(v) * g.spacing); }

TEST(NearestOn, KeepsSamplesOnTheSameGrid) {
  const VolumeGeometry grid = Placed({5, 4, 3}, {0.7, 1.1, 1.3}, {-31.7, 12.9, 4.1}, 0.3);
  const Volume labels = MakeVolume(grid, ScalarType::kUint16, [](const Index3& v) { return v.x + 10 * v.y + 50 * v.z; });
  EXPECT_EQ(NearestOn(grid, grid, labels.block, ScalarType::kUint16).bytes, labels.block.bytes);
}

TEST(NearestOn, IsTheVoxelThatHoldsThePointInWorldSpace) {
  Random random(3);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 20; ++i) {
    const auto real = [&](double low, double high) { return random.Real(low, high); };
    const VolumeGeometry grid = Placed({9, 8, 7}, {real(0.5, 2), 1, real(0.5, 2)}, {real(-3, 3), 1, 2}, real(-0.7, 0.7));
    const VolumeGeometry coarse = Placed({5, 6, 4}, {real(1, 3), 2, real(1, 3)}, {real(-3, 3), real(-3, 3), 0}, real(-0.7, 0.7));
    const Volume labels = MakeVolume(coarse, ScalarType::kUint16, [](const Index3& v) { return 1 + v.x + 5 * v.y + 30 * v.z; });
    const VoxelBlock found = NearestOn(grid, coarse, labels.block, ScalarType::kUint16);
    for (Index3 v; v.z < grid.size.z; ++v.z) {
      for (v.y = 0; v.y < grid.size.y; ++v.y) {
        for (v.x = 0; v.x < grid.size.x; ++v.x) {
          const std::uint16_t label = found.samples<std::uint16_t>()[found.Offset(v)];
          const Vec3 point = WorldOf(grid, v);
          // The label's own voxel is nearest; 0: none holds the point.
          bool expected_any = false;
          for (Index3 w; w.z < coarse.size.z; ++w.z) {
            for (w.y = 0; w.y < coarse.size.y; ++w.y) {
              for (w.x = 0; w.x < coarse.size.x; ++w.x) {
                const Vec3 from = coarse.orientation.FromWorld(point - WorldOf(coarse, w)) / coarse.spacing;
                const double farthest = std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)});
                if (farthest < 0.4999) {
                  expected_any = true;
                  EXPECT_EQ(label, 1 + w.x + 5 * w.y + 30 * w.z);
                } else if (farthest < 0.5001) {
                  expected_any = true;  // on a border: either
                }
              }
            }
          }
          EXPECT_TRUE(expected_any || label == 0);
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
