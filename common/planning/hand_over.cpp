#include "common/planning/balance.h"

namespace slabstream {

std::optional<Layout> HandOver(const BalanceRequest& request) { return Reassign(*request.now, request.make->slots, request.seconds); }

}  // namespace slabstream
