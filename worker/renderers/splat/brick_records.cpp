#include "worker/renderers/splat/brick_records.h"

#include "worker/renderers/brick_ranges.h"

namespace slabstream {

void BrickRecords::Need(const Index3& brick) {
  std::atomic<std::uint8_t>& state = states_[grid_.Number(brick)];
  std::uint8_t met = kNone;
  if (state.compare_exchange_strong(met, kBeingMade, std::memory_order_acquire)) {
    Make(brick);
    state.store(kMade, std::memory_order_release);
    state.notify_all();
    return;
  }
  state.wait(kBeingMade, std::memory_order_acquire);
}

void BrickRecords::NeedAll() {
  ForEachRowOfBricks(grid_, [&](Index3 brick) {
    for (; brick.x < grid_.first.x + grid_.counts.x; ++brick.x) Need(brick);
  });
}

}  // namespace slabstream
