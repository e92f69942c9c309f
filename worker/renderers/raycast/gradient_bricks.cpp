#include "worker/renderers/raycast/gradient_bricks.h"

namespace slabstream {

void GradientBricks::Enter(const RayBox& box) {
  if (samples_ == box.samples) return;
  samples_ = box.samples;
  if (corners_.empty()) corners_.resize(std::size_t(kMost) * kCorners);
  Clear();
}

void GradientBricks::Clear() {
  count_ = 0;
  slots_.fill({});
}

std::int32_t GradientBricks::Add(std::int32_t number) {
  std::uint32_t slot = SlotOf(number);
  while (slots_[slot].number != kNone) slot = (slot + 1) % kSlots;
  slots_[slot] = {number, count_++ * kCorners};
  return slots_[slot].first;
}

}  // namespace slabstream
