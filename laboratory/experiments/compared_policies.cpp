#include "laboratory/experiments/compared_policies.h"

#include <algorithm>
#include <utility>

#include "common/base/find_named.h"
#include "common/planning/assignment.h"
#include "common/planning/balance.h"
#include "laboratory/experiments/owner_arrangements.h"

namespace slabstream {

const std::vector<ComparedBalance>& ComparedBalances() {
  static const std::vector<ComparedBalance> entries = {
      {{"planes", "box boundaries move after every frame to where both sides took as long", MovePlanes}},
      {{"handover", "after every frame, busy workers hand whole boxes over to others", HandOver}, true},
  };
  return entries;
}

bool IsCompared(const Policy& policy) { return FindNamed(ComparedBalances(), policy.balance) != nullptr; }

Result<ResolvedRequest> ResolveCompared(FrameRequest request, DatasetId dataset, std::shared_ptr<const VolumeSummary> summary,
                                        std::uint32_t owners) {
  if (const OwnerArrangement* const arrangement = FindNamed(OwnerArrangements(), request.policy.assignment)) {
    auto held = std::make_shared<VolumeSummary>(*summary);
    held->owned = std::make_shared<const OwnedBoxes>(Arrange(*arrangement, summary->description.geometry.size, owners));
    summary = std::move(held);
    request.policy.assignment = std::ranges::find_if(Assignments(), &AssignmentEntry::by_owner)->name;
  }
  const ComparedBalance* const balance = FindNamed(ComparedBalances(), request.policy.balance);
  if (balance != nullptr) request.policy.balance = kDynamicBalance;  // boxes change, too
  Result<ResolvedRequest> resolved = ResolveRequest(std::move(request), dataset, std::move(summary));
  if (resolved.ok() && balance != nullptr) resolved->policy.balance = balance;
  return resolved;
}

std::optional<Layout> MovePlanes(const BalanceRequest& request) { return CutByCost(*request.make, &request.now->partition); }

std::optional<Layout> HandOver(const BalanceRequest& request) { return Reassign(*request.now, request.make->slots, request.seconds); }

}  // namespace slabstream
