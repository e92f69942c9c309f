// LabelUse: what labels (common/frame/layer_look.h) mean where there is no translucency, as in the Z-buffer, which draws opaque voxels and
// no others. Half decides, as it does of the transfer function's opacities: a label whose opacity is below 1/2 is clear.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/layer_look.h"

namespace slabstream {

enum class LabelUse : std::uint8_t {
  kAsVolume,  // the transfer function says whether voxels are opaque
  kClear,     // they are not
  kOpaque,    // they are
};

// By number; label 0 is none.
std::vector<LabelUse> UsesOf(const LabelLook& look);

}  // namespace slabstream
