#include "laboratory/experiments/compared_policies.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

#include "common/base/find_named.h"
#include "common/planning/balance.h"
#include "laboratory/experiments/owner_arrangements.h"

namespace slabstream {
namespace {

// Boxes to slots in turn, then back, and so on. Boxes of a partition are in the order of their places, so the first and the last of them
// lie on opposite sides of the volume: of the boxes of a slot, half are in front in whatever view the others are behind.
std::vector<std::uint32_t> AssignZigzag(const AssignmentRequest& request) {
  std::vector<std::uint32_t> slots(request.costs.size());
  for (std::size_t box = 0; box < slots.size(); ++box) {
    const std::size_t turn = box % (2 * std::size_t{request.slots});
    slots[box] = std::uint32_t(std::min(turn, 2 * std::size_t{request.slots} - 1 - turn));
  }
  return slots;
}

// Boxes to slots in turn, in a shuffled order that is the same every time: chance, for others to be compared with.
std::vector<std::uint32_t> AssignRandom(const AssignmentRequest& request) {
  std::vector<std::size_t> order(request.costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::minstd_rand random;  // its numbers are the same everywhere, and so is this shuffle (Fisher and Yates, 1938)
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  std::vector<std::uint32_t> slots(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) slots[order[i]] = std::uint32_t(i % request.slots);
  return slots;
}

}  // namespace

const std::vector<AssignmentEntry>& ComparedAssignments() {
  static const std::vector<AssignmentEntry> entries = {
      {"zigzag", "boxes to workers in turn and back: each has some in front and some behind", AssignZigzag},
      {"random", "boxes to workers as if by chance, the same every time", AssignRandom},
  };
  return entries;
}

const std::vector<ComparedBalance>& ComparedBalances() {
  static const std::vector<ComparedBalance> entries = {
      {{"planes", "box boundaries move after every frame to where both sides took as long", MovePlanes}},
      {{"handover", "after every frame, busy workers hand whole boxes over to others", HandOver}, true},
  };
  return entries;
}

bool IsCompared(const Policy& policy) {
  return FindNamed(ComparedAssignments(), policy.assignment) != nullptr || FindNamed(ComparedBalances(), policy.balance) != nullptr;
}

Result<ResolvedRequest> ResolveCompared(FrameRequest request, DatasetId dataset, std::shared_ptr<const VolumeSummary> summary,
                                        std::uint32_t owners) {
  if (const OwnerArrangement* const arrangement = FindNamed(OwnerArrangements(), request.policy.assignment)) {
    auto held = std::make_shared<VolumeSummary>(*summary);
    held->owned = std::make_shared<const OwnedBoxes>(Arrange(*arrangement, summary->description.geometry.size, owners));
    summary = std::move(held);
    request.policy.assignment = std::ranges::find_if(Assignments(), &AssignmentEntry::by_owner)->name;
  }
  const AssignmentEntry* const assignment = FindNamed(ComparedAssignments(), request.policy.assignment);
  const ComparedBalance* const balance = FindNamed(ComparedBalances(), request.policy.balance);
  if (assignment != nullptr) request.policy.assignment = Policy().assignment;
  if (balance != nullptr) request.policy.balance = kDynamicBalance;  // boxes change, too
  Result<ResolvedRequest> resolved = ResolveRequest(std::move(request), dataset, std::move(summary));
  if (!resolved.ok()) return resolved;
  if (assignment != nullptr) resolved->policy.assignment = assignment;
  if (balance != nullptr) resolved->policy.balance = balance;
  return resolved;
}

std::optional<Layout> MovePlanes(const BalanceRequest& request) { return CutByCost(*request.make, &request.now->partition); }

std::optional<Layout> HandOver(const BalanceRequest& request) { return Reassign(*request.now, request.make->slots, request.seconds); }

}  // namespace slabstream
