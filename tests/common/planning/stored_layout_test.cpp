// Layouts of volumes that nobody holds: boxes that fit a target, and end near the blocks in which the source is read.
#include <gtest/gtest.h>

#include "common/renderers/renderer_kind.h"
#include "tests/common/planning/plan_support.h"

namespace slabstream {
namespace {

VolumeSummary StoredSummary(const Index3& size, const Index3& block) {
  VolumeSummary summary = FullSummary(size);
  summary.stored = StoredAt{.source = "/data/scan.ome.zarr", .block = {{0, 0, 0}, block}};
  return summary;
}

std::int64_t PaddedVoxels(const FramePlan& plan, const Box& box) { return PaddedBox(box, plan.setup).voxel_count(); }

TEST(StoredLayout, BoxesTileTheVolumeAndFitTheTarget) {
  Random random(61);
  SCOPED_TRACE(random.trace());
  constexpr std::int64_t kTarget = 1 << 20;
  for (int round = 0; round < 40; ++round) {
    const Index3 size = {random.Integer(1, 300), random.Integer(1, 300), random.Integer(1, 300)};
    Index3 block;
    for (const Axis axis : kAxes) block[axis] = std::min(size[axis], 1 << random.Integer(0, 8));
    SCOPED_TRACE(testing::Message() << size.x << "x" << size.y << "x" << size.z << " in blocks of " << block.x << "x" << block.y << "x"
                                    << block.z);
    const VolumeSummary summary = StoredSummary(size, block);
    const Roster roster = FullRoster(random.Integer(1, 5));
    FrameRequest request = SomeRequest();
    request.renderer = random.Chance(0.5) ? "raycast" : "splat";
    request.policy.decomposition = random.Chance(0.5) ? "slab" : "subcube";
    const Result<FramePlan> plan = PlanFrame(request, 7, summary, roster, kTarget);
    ASSERT_TRUE(plan.ok()) << plan.status().message();
    ExpectSound(*plan, roster);
    std::int64_t voxels = 0;
    for (const Box& box : plan->layout->partition.boxes()) {
      ASSERT_LE(PaddedVoxels(*plan, box), kTarget);
      voxels += box.voxel_count();
    }
    EXPECT_EQ(voxels, summary.description.geometry.bounds().voxel_count());
    EXPECT_EQ(plan->setup.stored, summary.stored);
  }
}

TEST(StoredLayout, FewBlocksAreReadForTwoBoxes) {
  constexpr std::int32_t kBlock = 64;
  const VolumeSummary summary = StoredSummary({512, 512, 512}, Uniform(kBlock));
  for (const int workers : {1, 2, 3}) {
    const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, FullRoster(workers), 8 << 20).value();
    std::int64_t read = 0;
    for (const Box& box : plan.layout->partition.boxes()) {
      const Box padded = PaddedBox(box, plan.setup);
      std::int64_t blocks = 1;
      for (const Axis axis : kAxes) blocks *= (padded.end[axis] - 1) / kBlock - padded.begin[axis] / kBlock + 1;
      read += blocks;
      for (const Axis axis : kAxes) {
        if (box.end[axis] == 512) continue;
        EXPECT_EQ(padded.end[axis] % kBlock, 0) << "the halo behind a box is of the box's own blocks";
      }
    }
    EXPECT_GT(plan.layout->partition.boxes().size(), 8U);
    EXPECT_LE(read, 3 * 8 * 8 * 8);
  }
}

TEST(StoredLayout, BoxesThatShowNothingAreNobodys) {
  VolumeSummary summary = StoredSummary({256, 256, 256}, Uniform(32));
  for (std::size_t brick = 0; brick < summary.bricks.size() / 2; ++brick) summary.bricks[brick] = {0, 50};  // z below 128
  const Roster roster = FullRoster(2);
  const FramePlan plan = PlanFrame(SomeRequest(), 7, summary, roster, 1 << 20).value();
  ExpectSound(plan, roster);
  for (std::size_t box = 0; box < plan.layout->owners.size(); ++box) {
    const Box padded = PaddedBox(plan.layout->partition.boxes()[box], plan.setup);
    EXPECT_EQ(plan.layout->owners[box] != kNoSlot, padded.end.z > 128);
  }
}

TEST(StoredLayout, VoxelsThatAreHeldAreCutAsEver) {
  const VolumeSummary held = FullSummary({100, 100, 100});
  const FramePlan plan = Plan(SomeRequest(), held, FullRoster(2));
  EXPECT_FALSE(plan.setup.stored);
  EXPECT_EQ(plan.layout->partition.boxes().size(), 2U);
}

}  // namespace
}  // namespace slabstream
