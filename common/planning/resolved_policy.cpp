#include "common/planning/resolved_policy.h"

#include <fmt/format.h>

#include <vector>

#include "common/base/check.h"
#include "common/base/did_you_mean.h"
#include "common/base/find_named.h"
#include "common/combining/schemes.h"

namespace slabstream {
namespace {

template <class Entry>
Status CheckName(std::string_view field, std::string_view name, const std::vector<Entry>& entries) {
  if (FindNamed(entries, name) != nullptr) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("{} is '{}', but must be left out or one of: {}{}", field, name, NamesOf(entries), DidYouMean(name, entries)));
}

}  // namespace

Status CheckNames(const Policy& policy) {
  if (Status s = CheckName("policy.decomposition", policy.decomposition, Decompositions()); !s.ok()) return s;
  if (Status s = CheckName("policy.balance_by", policy.balance_by, BalanceByChoices()); !s.ok()) return s;
  if (Status s = CheckName("policy.assignment", policy.assignment, Assignments()); !s.ok()) return s;
  if (Status s = CheckName("policy.balance", policy.balance, Balances()); !s.ok()) return s;
  if (policy.combine.empty()) return Status::Ok();
  if (const auto scheme = ParseCombining(policy.combine); !scheme.ok()) {
    return Status::InvalidArgument("policy.combine " + scheme.status().message());
  }
  return Status::Ok();
}

Policy SettledPolicy(const FrameRequest& request, const VolumeGeometry& geometry) {
  Policy policy = request.policy;
  if (policy.axis == AxisChoice::kView) policy.axis = AxisChoice(MakeCamera(request.view, request.size, geometry).traversal_axis);
  return policy;
}

ResolvedPolicy ResolvePolicy(const Policy& policy, const VolumeGeometry& geometry) {
  const DecompositionEntry* const decomposition = FindNamed(Decompositions(), policy.decomposition);
  return {.decomposition = decomposition,
          .balance_by = FindBalanceBy(BalanceByOf(policy)).value(),
          .axis = SlabAxis(policy.axis, *decomposition, geometry.size),
          .groups = policy.groups,
          .assignment = FindNamed(Assignments(), policy.assignment),
          .balance = FindNamed(Balances(), policy.balance),
          .combine = policy.combine,
          .pixel_error = policy.pixel_error,
          .teams = policy.teams};
}

Axis SlabAxis(AxisChoice choice, const DecompositionEntry& decomposition, const Index3& size) {
  CHECK(choice != AxisChoice::kView);
  if (choice != AxisChoice::kAuto) return Axis(choice);
  // z, the axis that views turn about: slabs stacked along it hide little of each other from most sides, so none is rendered in vain.
  Axis longest = Axis::kZ;
  if (!decomposition.one_axis) return longest;
  for (Axis axis : {Axis::kY, Axis::kX}) {
    if (size[axis] > 2 * size.z && size[axis] > size[longest]) longest = axis;
  }
  return longest;
}

bool IsDynamic(const Policy& policy) { return FindNamed(Balances(), policy.balance)->change != nullptr; }

namespace {

// Whether boxes change, or find their owners, by what they cost.
bool UsesCosts(const Policy& policy) { return IsDynamic(policy) || FindNamed(Assignments(), policy.assignment)->by_cost; }

}  // namespace

std::string_view BalanceByOf(const Policy& policy) {
  if (policy.balance_by != kAutomatic) return policy.balance_by;
  const std::string_view suits = FindNamed(Decompositions(), policy.decomposition)->balance_by;
  return FindBalanceBy(suits) == BalanceBy::kBricks && UsesCosts(policy) ? NameOf(BalanceBy::kOccupied) : suits;
}

bool NeedsOccupancy(const Policy& policy) {
  const BalanceBy metric = FindBalanceBy(BalanceByOf(policy)).value();
  return metric == BalanceBy::kOccupied || metric == BalanceBy::kCost || UsesCosts(policy);
}

}  // namespace slabstream
