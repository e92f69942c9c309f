#include "common/planning/placement.h"

#include <algorithm>

#include "common/base/check.h"

namespace slabstream {
namespace {

bool Contains(const Roster& roster, WorkerId worker) {
  return worker != 0 && std::find(roster.slots.begin(), roster.slots.end(), worker) != roster.slots.end();
}

// The owner of the nearest box that shows anything, since it has that group's image at hand; of an empty frame the first worker.
WorkerId ChooseDisplay(const FramePlan& plan, const Roster& roster) {
  for (const GroupPlan& group : plan.groups) {
    if (!group.placements.empty()) return group.placements.front().worker;
  }
  return OwnerOf(0, roster);
}

// The display worker's rank, so that the group image need not travel; rank 0 if it has none.
Rank RootOf(const GroupPlan& group, WorkerId display) {
  const auto root = std::find_if(group.placements.begin(), group.placements.end(), [&](const Placement& p) { return p.worker == display; });
  return root == group.placements.end() ? 0 : Rank(root - group.placements.begin());
}

}  // namespace

WorkerId OwnerOf(BoxId box, const Roster& roster) {
  const std::size_t slots = roster.slots.size();
  if (slots == 0) return 0;
  const std::size_t slot = box % slots;
  if (roster.slots[slot] != 0) return roster.slots[slot];
  // Lent: neighbouring boxes of one lost slot, and the same boxes of several lost slots, go to different workers.
  const auto present = std::size_t(std::count_if(roster.slots.begin(), roster.slots.end(), [](WorkerId worker) { return worker != 0; }));
  if (present == 0) return 0;
  std::size_t skip = (box / slots + slot) % present;
  for (WorkerId worker : roster.slots) {
    if (worker != 0 && skip-- == 0) return worker;
  }
  return 0;
}

Status AssignWorkers(const Roster& roster, FramePlan& plan) {
  if (OwnerOf(0, roster) == 0) {
    return Status::Unavailable("the frame needs a worker, but none is registered");
  }
  for (GroupPlan& group : plan.groups) {
    for (Placement& placement : group.placements) placement.worker = OwnerOf(placement.id, roster);
  }
  if (!Contains(roster, plan.display)) plan.display = ChooseDisplay(plan, roster);

  const CombiningEntry* scheme = FindCombiningScheme(plan.combine);
  CHECK(scheme != nullptr) << plan.combine;
  const PixelRange frame = WholeFrame(plan.setup);
  for (GroupPlan& group : plan.groups) {
    group.schedule = group.placements.empty() ? Schedule{.ranks = 0, .root = 0, .steps = {}}
                                              : scheme->make({Rank(group.placements.size()), RootOf(group, plan.display), frame});
  }
  return Status::Ok();
}

Result<FramePlan> Replan(const FramePlan& plan, const Roster& roster) {
  CHECK_EQ(roster.slots.size(), plan.slots) << "a plan's boxes belong to its slots";
  FramePlan changed = plan;
  if (Status status = AssignWorkers(roster, changed); !status.ok()) return status;
  return changed;
}

}  // namespace slabstream
