// MatterLabels: which labels are material under any transfer function.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/layer_look.h"

namespace slabstream {

class MatterLabels {
 public:
  explicit MatterLabels(const LabelLook& look);

  bool any() const { return matter_before_.back() != 0; }
  // Numbers of labels, low to high; greater ones than there are count as the last. False if low > high.
  bool AnyBetween(float low, float high) const;
  friend bool operator==(const MatterLabels&, const MatterLabels&) = default;

 private:
  std::vector<std::int32_t> matter_before_;  // labels below this number
};

}  // namespace slabstream
