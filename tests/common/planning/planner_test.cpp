// Which boxes a plan has, in which groups.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "common/decomposition/decomposition.h"
#include "tests/common/planning/plan_support.h"

namespace slabstream {
namespace {

TEST(PlanFrame, IsSoundForAnyWorkersGroupsAndSizes) {
  for (const Index3& size : {Index3{1, 1, 1}, Index3{40, 40, 1}, Index3{33, 70, 20}, Index3{128, 64, 100}}) {
    const VolumeSummary summary = FullSummary(size);
    for (int workers : {1, 2, 3, 5, 8, 13, 64}) {
      for (int groups : {0, 1, 2, 7, 40}) {
        for (AxisChoice axis : {AxisChoice::kX, AxisChoice::kY, AxisChoice::kZ, AxisChoice::kAuto, AxisChoice::kView}) {
          SCOPED_TRACE(testing::Message() << size.x << "x" << size.y << "x" << size.z << ", " << workers << " workers, " << groups
                                          << " groups, axis " << int(axis));
          FrameRequest request = SomeRequest();
          request.policy.groups = groups;
          request.policy.axis = axis;
          request.view.azimuth_degrees = 200;
          const Roster roster = FullRoster(workers);
          const FramePlan plan = Plan(request, summary, roster);
          ExpectSound(plan, roster);
          EXPECT_EQ(PlacedBoxes(plan).size(), plan.layout->partition.boxes().size());  // everything is visible
          if (groups > 0 && groups * workers <= size[plan.slab_axis]) {
            EXPECT_EQ(plan.groups.size(), std::size_t(groups));
          }
        }
      }
    }
  }
}

// Calls check(request) for requests that differ in nothing but their views.
template <class Check>
void ForRandomViews(std::uint64_t seed, FrameRequest request, Check&& check) {
  Random random(seed);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    request.view = RandomView(random);
    check(request);
  }
}

TEST(PlanFrame, SlabsAlongTheViewDivideNoSlice) {
  const VolumeSummary summary = FullSummary({40, 90, 50});
  const Roster roster = FullRoster(4);
  FrameRequest request = SomeRequest();
  request.policy.axis = AxisChoice::kView;
  ForRandomViews(92, request, [&](const FrameRequest& seen) {
    const FramePlan plan = Plan(seen, summary, roster);
    EXPECT_EQ(plan.slab_axis, plan.setup.camera.traversal_axis);
    // As if the axis had been asked for: other views along it share the layout.
    FrameRequest same = seen;
    same.policy.axis = AxisChoice(plan.slab_axis);
    FramePlan other = Plan(same, summary, roster);
    EXPECT_EQ(*other.layout, *plan.layout);
    other.layout = plan.layout;  // plans are equal if they share it
    EXPECT_EQ(other, plan);
  });
}

TEST(PlanFrame, TurningTheViewReversesRanksButNeverOwnership) {
  const VolumeSummary summary = FullSummary({40, 90, 50});
  const Roster roster = FullRoster(4);
  FrameRequest request = SomeRequest();
  request.policy.groups = 3;
  request.policy.axis = AxisChoice::kY;
  const FramePlan first = Plan(request, summary, roster);
  ForRandomViews(91, request, [&](const FrameRequest& seen) {
    const FramePlan plan = Plan(seen, summary, roster);
    EXPECT_EQ(plan.layout->partition, first.layout->partition);
    std::vector<BoxId> forward = PlacedBoxes(first), boxes = PlacedBoxes(plan);
    if (plan.setup.camera.view_direction.y < 0 && seen.view.projection == Projection::kOrthographic) {
      std::reverse(forward.begin(), forward.end());
      EXPECT_EQ(boxes, forward);
    }
    for (const GroupPlan& group : plan.groups) {
      std::set<WorkerId> workers;
      for (const Placement& placement : group.placements) {
        EXPECT_EQ(placement.worker, roster.slots[placement.id % 4]);
        workers.insert(placement.worker);
      }
      EXPECT_EQ(workers.size(), group.placements.size());  // nobody renders two slabs of a group
    }
  });
}

TEST(PlanFrame, AutomaticChoicesDoNotDependOnTheView) {
  const VolumeSummary summary = FullSummary({100, 300, 300});
  constexpr std::int64_t kTarget = 1 << 20;
  FrameRequest request = SomeRequest();
  const Result<FramePlan> first = PlanFrame(request, 7, summary, FullRoster(2), kTarget);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first->slab_axis, Axis::kZ);  // about which views turn
  EXPECT_GT(first->groups.size(), 1U);
  ForRandomViews(92, request, [&](const FrameRequest& seen) {
    const Result<FramePlan> plan = PlanFrame(seen, 7, summary, FullRoster(2), kTarget);
    ASSERT_TRUE(plan.ok());
    EXPECT_EQ(plan->layout->partition, first->layout->partition);
  });
}

TEST(PlanFrame, ChoosesTheFewestGroupsWhoseBoxesStayUnderTheTarget) {
  const VolumeSummary summary = FullSummary({64, 64, 1000});
  const std::int64_t slice_bytes = 64 * 64;
  const auto groups = [&](std::int64_t target_slices, int workers) {
    return PlanFrame(SomeRequest(), 7, summary, FullRoster(workers), target_slices * slice_bytes)->groups.size();
  };
  EXPECT_EQ(groups(1000, 1), 1U);         // all of it fits
  EXPECT_EQ(groups(999, 1), 2U);          // halves and their halos
  EXPECT_EQ(groups(500 + kHalo, 1), 2U);  // which each have one neighbour
  EXPECT_EQ(groups(500 + kHalo - 1, 1), 3U);
  EXPECT_EQ(groups(250 + 2 * kHalo, 2), 2U);
  EXPECT_EQ(groups(1, 1), 1000U / kHalo);  // not thinner than a halo
  EXPECT_EQ(groups(1, 1000), 1U);
}

TEST(PlanFrame, ChoosesGroupsByTheLargestBoxThatShowsSomething) {
  // Visible are the bricks of one corner, 48 voxels a side.
  VolumeSummary summary = FullSummary({192, 192, 192});
  std::size_t brick = 0;
  for (Index3 b; b.z < 12; ++b.z) {
    for (b.y = 0; b.y < 12; ++b.y) {
      for (b.x = 0; b.x < 12; ++b.x, ++brick) {
        if (std::max({b.x, b.y, b.z}) > 2) summary.bricks[brick] = {0, 0};
      }
    }
  }
  for (const DecompositionEntry& entry : Decompositions()) {
    FrameRequest request = SomeRequest();
    request.policy.decomposition = entry.name;
    constexpr std::int64_t kTarget = 64 * 64 * 64;
    const FramePlan plan = *PlanFrame(request, 7, summary, FullRoster(2), kTarget);
    const std::vector<Placement> placements = PlacementsOf(plan);
    ASSERT_FALSE(placements.empty());
    // Slabs across the whole volume become as thin as their halo allows, and stay too large.
    if (entry.one_axis) continue;
    for (const Placement& placement : placements) {
      EXPECT_LE(PaddedBox(placement.box, plan.setup).voxel_count(), kTarget) << entry.name;
    }
  }
}

TEST(PlanFrame, LeavesOutBoxesThatShowNothing) {
  // Visible are the bricks at z in [64, 80) only.
  VolumeSummary summary = FullSummary({32, 32, 160});
  for (std::size_t brick = 0; brick < summary.bricks.size(); ++brick) {
    if (brick / 4 != 4) summary.bricks[brick] = {0, 0};
  }
  FrameRequest request = SomeRequest();  // opacity from 100 on
  request.policy.groups = 5;
  request.view.elevation_degrees = -90;  // along +z
  const Roster roster = FullRoster(2);
  const FramePlan plan = Plan(request, summary, roster);
  ExpectSound(plan, roster);
  ASSERT_EQ(plan.setup.halo, 8);
  // Slabs are 16 slices thick; the neighbours of [64, 80) see it through their halo.
  EXPECT_EQ(PlacedBoxes(plan), (std::vector<BoxId>{3, 4, 5}));
  EXPECT_EQ(plan.groups.size(), 2U);
  // Only boxes that show anything are dealt out, and the nearest one is the display worker's.
  EXPECT_EQ(plan.layout->owners, (std::vector<std::uint32_t>{kNoSlot, kNoSlot, kNoSlot, 0, 1, 0, kNoSlot, kNoSlot, kNoSlot, kNoSlot}));
  EXPECT_EQ(plan.display, roster.slots[0]);
}

TEST(PlanFrame, AnEmptyVolumeHasAPlanOfEmptyGroups) {
  VolumeSummary summary = FullSummary({32, 32, 32});
  for (ValueRange& brick : summary.bricks) brick = {0, 0};
  summary.bricks.front() = kNoFiniteValue;
  const Roster roster = FullRoster(3);
  const FramePlan plan = Plan(SomeRequest(), summary, roster);
  ExpectSound(plan, roster);
  EXPECT_TRUE(PlacedBoxes(plan).empty());
  EXPECT_EQ(plan.groups.size(), 1U);
  EXPECT_EQ(plan.groups[0].schedule, (ScheduleName{plan.combine, 0, {0}}));
  EXPECT_EQ(plan.display, roster.slots[0]);
}

}  // namespace
}  // namespace slabstream
