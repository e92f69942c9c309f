#include "common/frame/matter_labels.h"

#include <algorithm>

namespace slabstream {

MatterLabels::MatterLabels(const LabelLook& look) : matter_before_(1) {
  for (std::size_t number = 0; number <= look.entries.size(); ++number) {
    matter_before_.push_back(matter_before_.back() + (look.IsMatter(number) ? 1 : 0));
  }
}

bool MatterLabels::AnyBetween(float low, float high) const {
  if (!(low <= high)) return false;
  const auto number = [&](float stored) { return std::min(std::size_t(stored), matter_before_.size() - 2); };
  return matter_before_[number(high) + 1] > matter_before_[number(low)];
}

}  // namespace slabstream
