#include "common/planning/balances.h"

#include "common/planning/balance.h"

namespace slabstream {

const std::vector<BalanceEntry>& Balances() {
  static const std::vector<BalanceEntry> entries = {
      {"static", "boxes do not change"},
      {kDynamicBalance, "box boundaries move between frames if that saves more time than moving the voxels costs", Rebalance, false, true},
      {"planes", "box boundaries move after every frame to where both sides took as long; to compare with", MovePlanes},
      {"handover", "after every frame, busy workers hand whole boxes over to others; needs several --groups; to compare with", HandOver,
       true},
  };
  return entries;
}

}  // namespace slabstream
