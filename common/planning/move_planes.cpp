#include "common/planning/balance.h"

namespace slabstream {

std::optional<Layout> MovePlanes(const BalanceRequest& request) { return CutByCost(*request.make, &request.now->partition); }

}  // namespace slabstream
