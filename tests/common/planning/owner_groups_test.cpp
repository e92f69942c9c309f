// Groups of boxes that stay with their owners: exact for any arrangement, and few.
#include "common/planning/owner_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "common/planning/layout.h"
#include "tests/common/decomposition/random_partition.h"
#include "tests/support/random.h"

namespace slabstream {
namespace {

struct Case {
  Partition partition;
  std::vector<std::uint32_t> slots;
  Camera camera;
  Stretch stretch = {};
  std::vector<TouchingBoxes> touching = FindTouching(partition);

  OwnerGroupsRequest Request() const {
    return {.partition = &partition, .touching = touching, .slots = slots, .camera = &camera, .stretch = &stretch};
  }
  // In front of each box: those out of which a ray may pass into it.
  std::vector<std::vector<BoxId>> InFront() const {
    std::vector<std::vector<BoxId>> in_front(slots.size());
    for (const auto& [first, second] : touching) {
      const Passage passage = PassageBetween(partition.boxes()[first], partition.boxes()[second], camera, stretch);
      if (passage == Passage::kFromFirst) in_front[second].push_back(first);
      if (passage == Passage::kFromSecond) in_front[first].push_back(second);
    }
    return in_front;
  }
};

Camera RandomCamera(Random& random, const VolumeGeometry& geometry) {
  ViewParameters view;
  view.projection = random.Chance(0.5) ? Projection::kOrthographic : Projection::kPerspective;
  view.azimuth_degrees = random.Chance(0.3) ? 90 * random.Integer(0, 3) : random.Real(0, 360);
  view.elevation_degrees = random.Chance(0.3) ? 0 : random.Real(-90, 90);
  Camera camera = MakeCamera(view, {64, 64}, geometry);
  if (random.Chance(0.2)) camera.eye = {random.Real(0, 10), random.Real(0, 10), random.Real(0, 10)};
  return camera;
}

Case RandomCase(Random& random, int boxes, std::uint32_t slots, double empty) {
  const VolumeGeometry geometry = {{16, 14, 12}, {1, 1, 1}};
  Case made = {RandomPartition(random, geometry.bounds(), boxes), {}, RandomCamera(random, geometry)};
  for (std::size_t i = 0; i < made.partition.boxes().size(); ++i) {
    made.slots.push_back(random.Chance(empty) ? kNoSlot : random.Integer(0U, slots - 1));
  }
  return made;
}

// A box comes after all that lie in front of it, empty ones between them included; slots have one interval in each group.
void ExpectExact(const Case& of, const std::vector<std::vector<BoxId>>& groups) {
  const std::vector<std::vector<BoxId>> in_front = of.InFront();
  std::vector<bool> passed(of.slots.size());
  const auto is_free = [&](BoxId box) { return std::ranges::all_of(in_front[box], [&](BoxId front) { return passed[front]; }); };
  const auto pass_empty = [&] {
    for (bool again = true; again;) {
      again = false;
      for (BoxId box = 0; box < of.slots.size(); ++box) {
        if (of.slots[box] != kNoSlot || passed[box] || !is_free(box)) continue;
        passed[box] = again = true;
      }
    }
  };
  for (const std::vector<BoxId>& group : groups) {
    EXPECT_FALSE(group.empty());
    std::set<std::uint32_t> had;
    for (std::size_t rank = 0; rank < group.size(); ++rank) {
      const BoxId box = group[rank];
      pass_empty();
      ASSERT_FALSE(passed[box]);
      ASSERT_TRUE(is_free(box)) << "box " << box;
      passed[box] = true;
      if (rank > 0 && of.slots[group[rank - 1]] == of.slots[box]) continue;
      ASSERT_TRUE(had.insert(of.slots[box]).second) << "slot " << of.slots[box] << " has two runs";
    }
  }
  pass_empty();
  EXPECT_TRUE(std::ranges::all_of(passed, [](bool is) { return is; }));
}

// The fewest groups, by breadth-first search over the sets of boxes that groups may leave behind.
std::size_t FewestGroups(const Case& of) {
  const std::vector<std::vector<BoxId>> in_front = of.InFront();
  using Set = std::uint64_t;
  std::vector<Set> needs(of.slots.size());
  for (BoxId box = 0; box < of.slots.size(); ++box) {
    for (const BoxId front : in_front[box]) needs[box] |= Set{1} << front;
  }
  const auto take = [&](Set taken, std::uint32_t slot) {
    for (bool again = true; again;) {
      again = false;
      for (BoxId box = 0; box < of.slots.size(); ++box) {
        if ((taken >> box & 1U) != 0 || (needs[box] & ~taken) != 0 || (of.slots[box] != kNoSlot && of.slots[box] != slot)) continue;
        taken |= Set{1} << box;
        again = true;
      }
    }
    return taken;
  };
  std::uint32_t slots = 0;
  for (const std::uint32_t slot : of.slots) slots = slot == kNoSlot ? slots : std::max(slots, slot + 1);
  Set all = 0;
  for (BoxId box = 0; box < of.slots.size(); ++box) all |= Set{1} << box;
  std::set<Set> reached = {take(0, kNoSlot)};
  for (std::size_t groups = 0;; ++groups) {
    if (reached.contains(all)) return groups;
    // All orders of slots in one group: which slots have had their run, and what is taken.
    std::set<std::pair<std::uint32_t, Set>> within;
    for (const Set set : reached) within.insert({0, set});
    std::set<Set> next;
    while (!within.empty()) {
      std::set<std::pair<std::uint32_t, Set>> further;
      for (const auto& [had, taken] : within) {
        bool any = false;
        for (std::uint32_t slot = 0; slot < slots; ++slot) {
          if ((had >> slot & 1U) != 0) continue;
          const Set more = take(taken, slot);
          if (more == taken) continue;
          further.insert({had | 1U << slot, more});
          any = true;
        }
        if (!any) next.insert(taken);
      }
      within = std::move(further);
    }
    reached = std::move(next);
  }
}

TEST(OwnerGroups, AreExactForAnyArrangement) {
  Random random(65);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 300; ++i) {
    const Case of = RandomCase(random, random.Integer(1, 150), random.Integer(1U, 12U), i % 2 == 0 ? 0 : 0.3);
    ExpectExact(of, GroupByOwner(of.Request()));
  }
}

TEST(OwnerGroups, AreAlmostAlwaysTheFewest) {
  Random random(66);
  SCOPED_TRACE(random.trace());
  constexpr int kCases = 400;
  int more = 0;
  for (int i = 0; i < kCases; ++i) {
    const Case of = RandomCase(random, random.Integer(6, 24), random.Integer(2U, 4U), i % 4 == 0 ? 0.2 : 0);
    const std::size_t groups = GroupByOwner(of.Request()).size(), fewest = FewestGroups(of);
    ASSERT_GE(groups, fewest);
    EXPECT_LE(groups, fewest + 1);
    more += groups > fewest ? 1 : 0;
  }
  RecordProperty("cases_with_one_group_more", more);
  EXPECT_LE(more, kCases / 25);
}

TEST(OwnerGroups, OfBoxesOfOneWorkerEachAreOne) {
  Random random(67);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 50; ++i) {
    Case of = RandomCase(random, 30, 1, 0);
    for (std::uint32_t box = 0; box < of.slots.size(); ++box) of.slots[box] = box;
    EXPECT_EQ(GroupByOwner(of.Request()).size(), 1U);
    std::ranges::fill(of.slots, 0U);
    EXPECT_EQ(GroupByOwner(of.Request()).size(), 1U);
  }
}

TEST(OwnerGroups, KeepToTheBytesOfAGroup) {
  Random random(68);
  SCOPED_TRACE(random.trace());
  for (int i = 0; i < 100; ++i) {
    const Case of = RandomCase(random, 60, 4, 0.1);
    std::vector<std::uint64_t> bytes;
    for (std::size_t box = 0; box < of.slots.size(); ++box) bytes.push_back(random.Integer<std::uint64_t>(1, 100));
    OwnerGroupsRequest request = of.Request();
    request.bytes = bytes;
    request.most_bytes = 150;
    const std::vector<std::vector<BoxId>> groups = GroupByOwner(request);
    ExpectExact(of, groups);
    for (const std::vector<BoxId>& group : groups) {
      std::map<std::uint32_t, std::vector<BoxId>> by_slot;
      for (const BoxId box : group) by_slot[of.slots[box]].push_back(box);
      for (const auto& [slot, boxes] : by_slot) {
        std::uint64_t sum = 0;
        for (const BoxId box : boxes) sum += bytes[box];
        EXPECT_TRUE(boxes.size() == 1 || sum <= request.most_bytes);
      }
    }
  }
}

}  // namespace
}  // namespace slabstream
