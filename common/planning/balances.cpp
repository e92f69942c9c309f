#include "common/planning/balances.h"

#include "common/planning/balance.h"

namespace slabstream {

const std::vector<BalanceEntry>& Balances() {
  static const std::vector<BalanceEntry> entries = {
      {"static", "boxes do not change"},
      {kDynamicBalance, "box boundaries move between frames if that saves more time than moving the voxels costs", Rebalance, true},
  };
  return entries;
}

}  // namespace slabstream
