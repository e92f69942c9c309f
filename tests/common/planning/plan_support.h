// Plans made for tests, and what every plan must be.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "common/planning/placement.h"
#include "tests/common/planning/support.h"
#include "tests/support/check_schedule.h"

namespace slabstream {

inline FramePlan Plan(const FrameRequest& request, const VolumeSummary& summary, const Roster& roster) {
  Result<FramePlan> plan = PlanFrame(request, 7, summary, roster);
  EXPECT_TRUE(plan.ok()) << plan.status().message();
  return *plan;
}

// What every plan must be, whatever it was made for.
inline void ExpectSound(const FramePlan& plan, const Roster& roster) {
  std::vector<BoxId> order = VisibilityOrder(plan.layout->partition, plan.setup.camera);
  ASSERT_EQ(plan.layout->owners.size(), order.size());
  std::erase_if(order, [&](BoxId box) { return plan.layout->owners[box] == kNoSlot; });
  EXPECT_EQ(plan.groups.size(), std::max<std::size_t>(1, (order.size() + plan.slots - 1) / plan.slots));
  const std::vector<WorkerId> owners = OwnersOf(*plan.layout, roster, plan.alternates && plan.turn.number % 2 == 1);

  // The placements of all groups are the boxes that show something, in visibility order, each in the group where it belongs.
  std::map<BoxId, std::size_t> position;
  for (std::size_t i = 0; i < order.size(); ++i) position[order[i]] = i;
  const PixelRange frame = WholeFrame(plan.setup);
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    const GroupPlan& group = plan.groups[g];
    for (std::size_t rank = 0; rank < group.placements.size(); ++rank) {
      const Placement& placement = group.placements[rank];
      EXPECT_EQ(placement.box, plan.layout->partition.boxes()[placement.id]);
      EXPECT_EQ(position[placement.id] / plan.slots, g);
      if (rank > 0) {
        EXPECT_LT(position[group.placements[rank - 1].id], position[placement.id]);
      }
      EXPECT_EQ(placement.worker, owners[placement.id]);
      EXPECT_NE(placement.worker, 0U);
    }
    EXPECT_EQ(group.schedule.ranks, group.placements.size());
    EXPECT_EQ(CheckSchedule(DeriveSchedule(group.schedule, frame).value()->schedule(), frame), Status::Ok());
    // The display worker gets the group's image without another message if it has a rank.
    const bool has_rank = std::any_of(group.placements.begin(), group.placements.end(), [&](auto& p) { return p.worker == plan.display; });
    if (has_rank) {
      EXPECT_EQ(group.placements[group.schedule.roots.front()].worker, plan.display);
    }
  }
  EXPECT_NE(plan.display, 0U);
  EXPECT_NE(std::find(roster.slots.begin(), roster.slots.end(), plan.display), roster.slots.end());
}

inline std::vector<BoxId> PlacedBoxes(const FramePlan& plan) {
  std::vector<BoxId> boxes;
  for (const GroupPlan& group : plan.groups) {
    for (const Placement& placement : group.placements) boxes.push_back(placement.id);
  }
  return boxes;
}

}  // namespace slabstream
