#include "laboratory/measure/box_costs.h"

#include <gtest/gtest.h>

#include "common/decomposition/decomposition.h"
#include "tests/common/mesh/mesh_samples.h"
#include "tests/support/renderers.h"
#include "tests/worker/renderers/render_support.h"

namespace slabstream {
namespace {

using namespace slabstream::testing;  // NOLINT(google-build-using-namespace): test support

TEST(BoxCosts, CountsOfBoxesAddUpToThoseOfTheVolume) {
  const Volume volume = AsGrid(MakeBlobs({{40, 32, 48}, {1, 1, 1}}, ScalarType::kUint8, 3));
  for (const RendererKind* renderer : Renderers()) {
    const FrameSetup setup = MakeSetup(volume, {.renderer = renderer});
    const std::vector<BoxCost> whole = MeasureBoxCosts(volume, setup, std::vector{volume.block.box}, 1);
    ASSERT_EQ(whole.size(), 1U);
    EXPECT_GT(whole[0].seconds, 0);
    EXPECT_GT(whole[0].first_seconds, 0);
    EXPECT_GT(whole[0].covered_pixels, 0U);
    EXPECT_LE(whole[0].covered_pixels, std::uint64_t(whole[0].bounds.pixel_count()));
    EXPECT_EQ(whole[0].voxel_bytes, volume.block.bytes.size());

    const Partition slabs = CutIntoSlabs(volume, 5, Axis::kY);
    const std::vector<BoxCost> costs = MeasureBoxCosts(volume, setup, slabs.boxes(), 2);
    ASSERT_EQ(costs.size(), 5U);
    std::uint64_t occupied = 0;
    for (std::size_t i = 0; i < costs.size(); ++i) {
      EXPECT_EQ(costs[i].box, slabs.boxes()[i]);
      EXPECT_EQ(costs[i].voxel_bytes, std::uint64_t(PaddedBox(costs[i].box, setup).voxel_count()) * sizeof(float));
      EXPECT_TRUE(whole[0].bounds.Contains(costs[i].bounds));
      occupied += costs[i].occupied_voxels;
    }
    EXPECT_EQ(occupied, whole[0].occupied_voxels);
  }
}

TEST(BoxCosts, ImbalanceIsLargestOverMean) {
  EXPECT_DOUBLE_EQ(Imbalance(std::vector{1.0, 2.0, 3.0}), 1.5);
  EXPECT_DOUBLE_EQ(Imbalance(std::vector{4.0, 4.0}), 1);
  EXPECT_DOUBLE_EQ(Imbalance(std::vector{0.0, 0.0}), 1);
  EXPECT_DOUBLE_EQ(Imbalance({}), 1);
}

}  // namespace
}  // namespace slabstream
