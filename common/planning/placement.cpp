#include "common/planning/placement.h"

#include <algorithm>
#include <iterator>

#include "common/base/check.h"
#include "common/combining/schemes.h"

namespace slabstream {
namespace {

bool Contains(const Roster& roster, WorkerId worker) {
  return worker != 0 && std::find(roster.slots.begin(), roster.slots.end(), worker) != roster.slots.end();
}

// 0: there is none.
WorkerId FirstWorker(const Roster& roster) {
  const auto first = std::find_if(roster.slots.begin(), roster.slots.end(), [](WorkerId worker) { return worker != 0; });
  return first == roster.slots.end() ? 0 : *first;
}

// The owner of the nearest box that shows anything, since it has that group's image at hand; of an empty frame the first worker.
WorkerId ChooseDisplay(const FramePlan& plan, const Roster& roster) {
  for (const GroupPlan& group : plan.groups) {
    if (!group.placements.empty()) return group.placements.front().worker;
  }
  return FirstWorker(roster);
}

// The display worker's rank, so that the group image need not travel; rank 0 if it has none.
Rank RootOf(const GroupPlan& group, WorkerId display) {
  const auto root = std::find_if(group.placements.begin(), group.placements.end(), [&](const Placement& p) { return p.worker == display; });
  return root == group.placements.end() ? 0 : Rank(root - group.placements.begin());
}

// The fewest bits by which combining moves no channel by more than the plan allows. Of two codings of as many bits the finer one.
ColorCoding ChooseColor(const FramePlan& plan, const GroupPlan& group) {
  if (plan.pixel_error <= 0 || plan.setup.renderer != RendererKind::kSplat || group.placements.empty()) return ColorCoding::kFloat32;
  Travel travel = TravelOf(group.schedule, WholeFrame(plan.setup));
  if (group.placements[group.schedule.root].worker != plan.display) travel = {travel.hops + 1, travel.transfers + 1};
  ColorCoding best = ColorCoding::kFloat32;
  double least = plan.pixel_error;
  for (const ColorCoding coding : {ColorCoding::kHalf, ColorCoding::kFixed16}) {
    const double error = CodingError(coding, travel.hops, travel.transfers);
    if (error > least) continue;
    best = coding;
    least = error;
  }
  return best;
}

}  // namespace

std::vector<WorkerId> OwnersOf(const Layout& layout, const Roster& roster) {
  std::vector<WorkerId> present;
  std::copy_if(roster.slots.begin(), roster.slots.end(), std::back_inserter(present), [](WorkerId worker) { return worker != 0; });
  std::vector<WorkerId> owners(layout.owners.size());
  if (present.empty()) return owners;
  std::vector<std::size_t> lent(roster.slots.size());  // boxes of each slot so far
  for (std::size_t box = 0; box < owners.size(); ++box) {
    const std::uint32_t slot = layout.owners[box];
    if (slot == kNoSlot) continue;
    CHECK_LT(slot, roster.slots.size());
    // Lent: the boxes of one lost slot, and the first boxes of several lost slots, go to different workers.
    owners[box] = roster.slots[slot] != 0 ? roster.slots[slot] : present[(lent[slot]++ + slot) % present.size()];
  }
  return owners;
}

Status AssignWorkers(const Roster& roster, FramePlan& plan) {
  if (FirstWorker(roster) == 0) return Status::Unavailable("the frame needs a worker, but none is registered");
  const std::vector<WorkerId> owners = OwnersOf(plan.layout, roster);
  for (GroupPlan& group : plan.groups) {
    for (Placement& placement : group.placements) placement.worker = owners[placement.id];
  }
  if (!Contains(roster, plan.display)) plan.display = ChooseDisplay(plan, roster);

  const Result<CombiningChoice> scheme = ParseCombining(plan.combine);
  CHECK(scheme.ok()) << scheme.status().message();
  const PixelRange frame = WholeFrame(plan.setup);
  for (GroupPlan& group : plan.groups) {
    group.schedule = group.placements.empty() ? Schedule{.ranks = 0, .root = 0, .steps = {}}
                                              : scheme->Make({Rank(group.placements.size()), RootOf(group, plan.display), frame});
    group.color = ChooseColor(plan, group);
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
