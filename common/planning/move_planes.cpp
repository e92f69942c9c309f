#include "common/planning/balance.h"
#include "common/planning/balances.h"

namespace slabstream {

std::optional<Layout> MovePlanes(const BalanceRequest& request) {
  ResolvedPolicy by_cost = *request.make->policy;
  by_cost.balance_by = BalanceBy::kCost;
  LayoutRequest moved = *request.make;
  moved.policy = &by_cost;
  moved.resized = &request.now->partition;
  return MakeLayout(moved);
}

}  // namespace slabstream
