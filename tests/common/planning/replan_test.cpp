// Who does what: turns of display workers, and plans after the loss of workers.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "common/combining/schemes.h"
#include "common/planning/assignment.h"
#include "common/planning/placement.h"
#include "tests/common/planning/plan_support.h"

namespace slabstream {
namespace {

TEST(PlanFrame, DisplayWorkersTakeTurns) {
  for (int workers = 1; workers <= 7; ++workers) {
    FrameRequest request = SomeRequest();
    request.policy.groups = 3;
    const Roster roster = FullRoster(workers);
    const FramePlan first = Plan(request, FullSummary({96, 96, 96}), roster);
    std::set<WorkerId> displays;
    for (std::uint64_t turn = 0; turn < 2 * std::uint64_t(workers); ++turn) {
      const FramePlan plan = TakeTurn(first, roster, {turn, 1});
      ExpectSound(plan, roster);
      EXPECT_EQ(PlacedBoxes(plan), PlacedBoxes(first));
      EXPECT_EQ(plan.display, TakeTurn(first, roster, {turn + std::uint64_t(workers), 1}).display);
      displays.insert(plan.display);
    }
    EXPECT_EQ(displays.size(), std::size_t(workers));
  }
}

TEST(PlanFrame, SharesAreOfDifferentWorkersAndTakeTurns) {
  for (int workers = 2; workers <= 9; ++workers) {
    FrameRequest request = SomeRequest();
    request.policy.groups = 1;
    Roster roster = FullRoster(workers);
    FramePlan first = Plan(request, FullSummary({96, 96, 96}), roster);
    if (workers > 2) roster.slots.back() = 0;  // another worker has its box
    const std::size_t present = std::size_t(workers) - (workers > 2 ? 1 : 0);
    for (std::size_t shares = 1; shares <= present + 1; ++shares) {
      first.client.share_pixels = WholeFrame(first.setup).end / shares;
      std::set<WorkerId> all;
      for (std::uint64_t turn = 0; turn < present; ++turn) {
        const FramePlan plan = TakeTurn(first, roster, {turn, 1});
        ExpectSound(plan, roster);
        const std::vector<WorkerId> displays = DisplaysOf(plan.groups.front(), plan.display);
        const std::set<WorkerId> distinct(displays.begin(), displays.end());
        EXPECT_EQ(displays.size(), std::min(shares, present));
        EXPECT_EQ(distinct.size(), displays.size());
        EXPECT_EQ(displays.front(), plan.display);
        all.insert(displays.begin(), displays.end());
      }
      EXPECT_EQ(all.size(), present) << shares << " shares";
    }
    // A box that is tried alone is in nobody's way.
    first.client.share_pixels = 1;
    const FramePlan trial = *Replan(first, roster, {{first.groups.front().placements.front().id}, 1});
    EXPECT_EQ(trial.groups.front().schedule.roots.size(), 1U);
  }
}

TEST(Replan, ReassignsLostBoxesAndChangesNothingElse) {
  const VolumeSummary summary = FullSummary({40, 40, 120});
  for (const CombiningEntry& scheme : CombiningSchemes()) {
    for (int workers : {2, 3, 5, 8}) {
      FrameRequest request = SomeRequest();
      request.policy.groups = 3;
      request.policy.combine = scheme.name;
      const FramePlan plan = Plan(request, summary, FullRoster(workers));
      for (int lost = 0; lost < workers; ++lost) {
        SCOPED_TRACE(testing::Message() << scheme.name << ", " << workers << " workers, lost " << lost);
        Roster rest = FullRoster(workers);
        rest.slots[std::size_t(lost)] = 0;
        const Result<FramePlan> again = Replan(plan, rest);
        ASSERT_TRUE(again.ok());
        ExpectSound(*again, rest);
        EXPECT_EQ(again->setup, plan.setup);
        EXPECT_EQ(again->layout->partition, plan.layout->partition);
        EXPECT_EQ(PlacedBoxes(*again), PlacedBoxes(plan));
        ASSERT_EQ(again->groups.size(), plan.groups.size());
        std::set<WorkerId> lenders;
        for (std::size_t g = 0; g < plan.groups.size(); ++g) {
          ASSERT_EQ(again->groups[g].placements.size(), plan.groups[g].placements.size());
          for (std::size_t rank = 0; rank < plan.groups[g].placements.size(); ++rank) {
            const WorkerId before = plan.groups[g].placements[rank].worker, after = again->groups[g].placements[rank].worker;
            if (before == WorkerId(lost + 1)) {
              lenders.insert(after);
            } else {
              EXPECT_EQ(after, before);
            }
          }
        }
        EXPECT_EQ(lenders.size(), std::size_t(std::min(3, workers - 1)));  // its three boxes go to different workers
        if (plan.display != WorkerId(lost + 1)) {
          EXPECT_EQ(again->display, plan.display);
        }
        // Back again, or another in its place: everything as it was.
        Roster back = FullRoster(workers);
        EXPECT_EQ(PlacedBoxes(*Replan(*again, back)), PlacedBoxes(plan));
      }
    }
  }
}

TEST(Replan, SurvivesAllButOne) {
  Random random(93);
  SCOPED_TRACE(random.trace());
  const VolumeSummary summary = FullSummary({40, 40, 120});
  FrameRequest request = SomeRequest();
  request.policy.groups = 4;
  FramePlan plan = Plan(request, summary, FullRoster(9));
  Roster roster = FullRoster(9);
  for (int left = 8; left >= 1; --left) {
    std::size_t lost = random.Integer<std::size_t>(0, 8);
    while (roster.slots[lost] == 0) lost = (lost + 1) % 9;
    roster.slots[lost] = 0;
    const Result<FramePlan> next = Replan(plan, roster);
    ASSERT_TRUE(next.ok());
    ExpectSound(*next, roster);
    plan = *next;
  }
  EXPECT_EQ(Replan(plan, Roster{std::vector<WorkerId>(9)}).status().code(), StatusCode::kUnavailable);
}

TEST(Replan, SetsBoxesApart) {
  const VolumeSummary summary = FullSummary({40, 40, 120});
  FrameRequest request = SomeRequest();
  request.policy.groups = 3;
  for (const int workers : {1, 2, 5}) {
    const FramePlan plan = Plan(request, summary, FullRoster(workers));
    Roster rest = FullRoster(workers);
    if (workers > 1) rest.slots[plan.display - 1] = 0;  // another display worker is needed, too
    const GroupPlan& first = plan.groups.front();
    const SetApart apart = {{first.placements.front().id, first.placements.back().id},
                            WorkerId(workers == 1        ? 1
                                     : plan.display == 1 ? 2
                                                         : 1)};
    const Result<FramePlan> again = Replan(plan, rest, apart);
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(PlacedBoxes(*again), PlacedBoxes(plan));
    for (const Placement& placement : again->groups.front().placements) {
      const bool alone = apart.boxes.contains(placement.id);
      if (alone || workers > 2) {
        EXPECT_EQ(placement.worker == apart.worker, alone) << workers;
      }
    }
    if (workers > 2) {
      EXPECT_NE(again->display, apart.worker);
    }
    const Result<FramePlan> as_ever = Replan(plan, rest);
    for (std::size_t group = 1; group < plan.groups.size(); ++group) {
      for (std::size_t rank = 0; rank < plan.groups[group].placements.size(); ++rank) {
        EXPECT_EQ(again->groups[group].placements[rank].worker, as_ever->groups[group].placements[rank].worker);
      }
    }
  }
}

TEST(OwnersOf, LendsTheBoxesOfVacantSlotsEvenly) {
  for (const AssignmentEntry& assignment : Assignments()) {
    const Roster roster = {{11, 0, 13, 0, 15}};
    Layout layout;
    const std::vector<double> costs(5 * 30, 1.0);
    std::vector<std::uint32_t> holders(costs.size());  // each holds a box
    std::iota(holders.begin(), holders.end(), 0U);
    layout.owners = assignment.assign({.costs = costs, .slots = 5, .holders = holders, .holder_count = std::uint32_t(holders.size())});
    layout.owners.insert(layout.owners.begin() + 7, kNoSlot);
    const std::vector<WorkerId> owners = OwnersOf(layout, roster);
    ASSERT_EQ(owners.size(), layout.owners.size());
    std::map<WorkerId, int> lent;
    for (std::size_t box = 0; box < owners.size(); ++box) {
      if (layout.owners[box] == kNoSlot) {
        EXPECT_EQ(owners[box], 0U);
      } else if (roster.slots[layout.owners[box]] != 0) {
        EXPECT_EQ(owners[box], roster.slots[layout.owners[box]]);
      } else {
        ++lent[owners[box]];
      }
    }
    EXPECT_EQ(lent, (std::map<WorkerId, int>{{11, 20}, {13, 20}, {15, 20}})) << assignment.name;
    EXPECT_EQ(OwnersOf(layout, Roster{{0, 0, 0, 0, 0}}), std::vector<WorkerId>(layout.owners.size()));
  }
}

// Whatever turn it is, all boxes are rendered once, and two frames in a row give each worker the boxes of two slots: its own and, of a
// partition along the volume, those on the other side.
TEST(AlternatingBoxes, ChangeHandsInEveryOtherFrame) {
  for (const std::uint32_t slots : {1U, 2U, 5U, 16U}) {
    for (const int groups : {1, 3}) {
      FrameRequest request = SomeRequest();
      request.policy.groups = groups;
      request.policy.assignment = "alternating";
      const Roster roster = RosterOf(slots);
      const FramePlan first = Plan(request, FullSummary({96, 96, 96}), roster);
      const FramePlan second = TakeTurn(first, roster, {.number = 1}), third = TakeTurn(first, roster, {.number = 2});
      for (const FramePlan* plan : {&first, &second, &third}) ExpectSound(*plan, roster);
      for (std::size_t group = 0; group < first.groups.size(); ++group) {
        for (std::size_t rank = 0; rank < first.groups[group].placements.size(); ++rank) {
          const auto worker = [&](const FramePlan& plan) { return plan.groups[group].placements[rank].worker; };
          EXPECT_EQ(worker(second), slots + 1 - worker(first)) << slots << " slots";
          EXPECT_EQ(worker(third), worker(first));
        }
      }
      // Whoever takes a lost worker's place in a frame, the others keep what they have in this turn.
      Roster rest = roster;
      rest.slots[0] = 0;
      const Result<FramePlan> again = Replan(second, rest);
      if (slots == 1) continue;
      ASSERT_TRUE(again.ok());
      ExpectSound(*again, rest);
      for (std::size_t group = 0; group < first.groups.size(); ++group) {
        for (std::size_t rank = 0; rank < first.groups[group].placements.size(); ++rank) {
          const WorkerId before = second.groups[group].placements[rank].worker;
          if (before != 1) {
            EXPECT_EQ(again->groups[group].placements[rank].worker, before);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
