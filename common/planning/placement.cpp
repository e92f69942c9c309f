#include "common/planning/placement.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <ranges>

#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/combining/travel.h"
#include "common/planning/owner_groups.h"
#include "common/renderers/renderer_kind.h"

namespace slabstream {
namespace {

bool Contains(const Roster& roster, WorkerId worker) {
  const auto among = [worker](const std::vector<WorkerId>& workers) { return std::ranges::find(workers, worker) != workers.end(); };
  return worker != 0 && (among(roster.slots) || among(roster.leaving));
}

std::vector<WorkerId> Present(const Roster& roster) {
  std::vector<WorkerId> present;
  std::copy_if(roster.slots.begin(), roster.slots.end(), std::back_inserter(present), [](WorkerId worker) { return worker != 0; });
  return present;
}

// A display worker that holds a rank of a group can be the root of its schedule, so that the image need not travel.
WorkerId ChooseDisplay(const FramePlan& plan, const std::vector<WorkerId>& present) {
  std::map<WorkerId, std::size_t> groups;  // number of groups in which it holds a rank
  for (const WorkerId worker : present) groups[worker] = 0;
  for (const GroupPlan& group : plan.groups) {
    std::set<WorkerId> workers;
    for (const Placement& placement : group.placements) workers.insert(placement.worker);
    for (const WorkerId worker : workers) {
      if (const auto found = groups.find(worker); found != groups.end()) ++found->second;
    }
  }
  const std::size_t most = std::ranges::max(groups | std::views::values);
  std::vector<WorkerId> candidates;
  std::ranges::copy_if(present, std::back_inserter(candidates), [&](WorkerId worker) { return groups.at(worker) == most; });
  return candidates[plan.turn.number % candidates.size()];
}

std::vector<std::vector<BoxId>> GroupsOf(const FramePlan& plan) {
  const Layout& layout = *plan.layout;
  const Stretch& stretch = plan.setup.description.geometry.stretch;
  if (!layout.touching.empty()) {
    std::vector<std::uint64_t> bytes;
    for (const Box& box : layout.partition.boxes()) {
      bytes.push_back(std::uint64_t(PaddedBox({box, 0}, plan.setup).voxel_count()) * BytesPerSample(plan.setup.description.type));
    }
    return GroupByOwner({.partition = &layout.partition,
                         .touching = layout.touching,
                         .slots = layout.owners,
                         .camera = &plan.setup.camera,
                         .stretch = &stretch,
                         .bytes = bytes,
                         .most_bytes = layout.group_bytes});
  }
  std::vector<std::vector<BoxId>> groups;
  for (const BoxId id : VisibilityOrder(layout.partition, plan.setup.camera, stretch)) {
    if (layout.owners[id] == kNoSlot) continue;
    if (groups.empty() || groups.back().size() == plan.slots) groups.emplace_back();
    groups.back().push_back(id);
  }
  return groups;
}

// Where another worker's ranks begin; empty if no worker has two ranks in a row.
std::vector<Rank> RunsOf(const GroupPlan& group) {
  std::vector<Rank> runs;
  for (Rank rank = 0; rank < group.placements.size(); ++rank) {
    if (rank == 0 || group.placements[rank].worker != group.placements[rank - 1].worker) runs.push_back(rank);
  }
  if (runs.size() == group.placements.size()) runs.clear();
  return runs;
}

// Gives what else `apart.worker` holds of the groups of its boxes to `others`, in turn.
void Separate(const SetApart& apart, const std::vector<WorkerId>& others, FramePlan& plan) {
  std::size_t next = 0;
  for (GroupPlan& group : plan.groups) {
    const auto is_apart = [&](const Placement& placement) { return apart.boxes.contains(placement.id); };
    if (std::ranges::none_of(group.placements, is_apart)) continue;
    for (Placement& placement : group.placements) {
      if (is_apart(placement)) {
        placement.worker = apart.worker;
      } else if (placement.worker == apart.worker) {
        placement.worker = others[next++ % others.size()];
      }
    }
  }
}

// The fewest bits with which combining changes no channel by more than the plan allows. Of two codings with as many bits, the finer one.
ColorCoding ChooseColor(const FramePlan& plan, const GroupPlan& group) {
  // A pixel of the picture is that of one worker, so it has the same codes whether these are made before it travels or after that.
  const bool is_of_one = plan.setup.format == PixelFormat::kDepth && plan.setup.renderer->FrameIsPicture(plan.setup);
  if (is_of_one && plan.client.straight8) return ColorCoding::kStraight8;
  if (plan.pixel_error <= 0 || plan.setup.format != PixelFormat::kRgba || group.placements.empty()) return ColorCoding::kFloat32;
  const PixelRange frame = WholeFrame(plan.setup);
  // Images of a run do not travel.
  Travel travel = TravelOf(DeriveSchedule(AmongRuns(group.schedule), frame).value(), frame);
  if (DisplaysOf(group, plan.display).front() != group.placements[group.schedule.roots.front()].worker)
    travel = {travel.hops + 1, travel.transfers + 1};
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

Rank RootOf(const GroupPlan& group, WorkerId display) {
  const auto root = std::find_if(group.placements.begin(), group.placements.end(), [&](const Placement& p) { return p.worker == display; });
  return root == group.placements.end() ? 0 : Rank(root - group.placements.begin());
}

std::vector<Rank> SharesOf(const FramePlan& plan) {
  const GroupPlan& group = plan.groups.front();
  const RendererKind& renderer = *plan.setup.renderer;
  const std::vector<Rank> one = {RootOf(group, plan.display)};
  if (plan.client.share_pixels == 0 || group.placements.empty() || !renderer.FinishesInShares(plan.setup)) return one;
  const bool pays = !renderer.FrameIsPicture(plan.setup) || ParseCombining(plan.combine).value().scheme->divides() ||
                    WholeFrame(plan.setup).end >= kLargePicture;
  if (!pays) return one;
  std::vector<Rank> candidates;  // the first of each worker
  std::set<WorkerId> workers;
  for (Rank rank = 0; rank < group.placements.size(); ++rank) {
    if (workers.insert(group.placements[rank].worker).second) candidates.push_back(rank);
  }
  const std::uint64_t shares = std::min<std::uint64_t>(
      {candidates.size(), kMaxShares, kMaxSteps / group.placements.size(), WholeFrame(plan.setup).end / plan.client.share_pixels});
  if (shares < 2) return one;
  std::vector<Rank> roots;
  for (std::uint64_t share = 0; share < shares; ++share) {
    roots.push_back(candidates[(plan.turn.number + share * candidates.size() / shares) % candidates.size()]);
  }
  return roots;
}

Roster RosterOf(std::uint32_t workers) {
  Roster roster;
  for (WorkerId worker = 1; worker <= workers; ++worker) roster.slots.push_back(worker);
  return roster;
}

std::vector<WorkerId> OwnersOf(const Layout& layout, const Roster& roster, bool reversed) {
  const std::vector<WorkerId> present = Present(roster);
  std::vector<WorkerId> owners(layout.owners.size());
  if (present.empty()) return owners;
  std::vector<std::size_t> lent(roster.slots.size());  // boxes of each slot so far
  for (std::size_t box = 0; box < owners.size(); ++box) {
    if (layout.owners[box] == kNoSlot) continue;
    CHECK_LT(layout.owners[box], roster.slots.size());
    const std::uint32_t slot = reversed ? std::uint32_t(roster.slots.size()) - 1 - layout.owners[box] : layout.owners[box];
    // Lent: the boxes of one lost slot, and the first boxes of several lost slots, go to different workers.
    owners[box] = roster.slots[slot] != 0 ? roster.slots[slot] : present[(lent[slot]++ + slot) % present.size()];
  }
  return owners;
}

void PlaceBoxes(FramePlan& plan) {
  plan.groups.clear();
  for (const std::vector<BoxId>& boxes : GroupsOf(plan)) {
    GroupPlan& group = plan.groups.emplace_back();
    for (const BoxId id : boxes) {
      const std::uint8_t level = plan.layout->levels.empty() ? std::uint8_t{0} : plan.layout->levels[id];
      group.placements.push_back({id, plan.layout->partition.boxes()[id], 0, level});
      if (!plan.layout->filled.empty()) group.placements.back().filled = plan.layout->filled[id];
    }
  }
  if (plan.groups.empty()) plan.groups.emplace_back();
}

Status AssignWorkers(const Roster& roster, FramePlan& plan, const SetApart& apart) {
  std::vector<WorkerId> present = Present(roster);
  if (present.empty()) return Status::Unavailable("the frame needs a worker, but none is registered");
  const std::vector<WorkerId> owners = OwnersOf(*plan.layout, roster, plan.alternates && plan.turn.number % 2 == 1);
  for (GroupPlan& group : plan.groups) {
    for (Placement& placement : group.placements) placement.worker = owners[placement.id];
  }
  if (!apart.boxes.empty()) {
    if (present.size() > 1) std::erase(present, apart.worker);
    Separate(apart, present, plan);
  }
  if (!Contains(roster, plan.display)) plan.display = ChooseDisplay(plan, present);

  for (GroupPlan& group : plan.groups) {
    const bool may_divide = plan.groups.size() == 1 && apart.boxes.empty();
    group.schedule = {plan.combine, Rank(group.placements.size()),
                      may_divide ? SharesOf(plan) : std::vector<Rank>{RootOf(group, plan.display)}, RunsOf(group)};
    if (group.schedule.roots.size() > 1) plan.display = group.placements[group.schedule.roots.front()].worker;
    group.color = ChooseColor(plan, group);
  }
  return Status::Ok();
}

Result<FramePlan> Replan(const FramePlan& plan, const Roster& roster, const SetApart& apart) {
  CHECK_EQ(roster.slots.size(), plan.slots) << "a plan's boxes belong to its slots";
  FramePlan changed = plan;
  changed.tiles.clear();
  if (Status status = AssignWorkers(roster, changed, apart); !status.ok()) return status;
  return changed;
}

FramePlan TakeTurn(const FramePlan& plan, const Roster& roster, const Turn& turn) {
  FramePlan other = plan;
  other.turn = turn;
  other.display = 0;
  const Status status = AssignWorkers(roster, other);
  CHECK(status.ok()) << status.message();
  other.tiles = PlanTiles(other);
  return other;
}

}  // namespace slabstream
