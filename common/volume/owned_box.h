// OwnedBox: voxels that a process, or a file that one has written, holds. Those of a volume tile it. An owner may have any number of boxes,
// and they need not touch.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

struct OwnedBox {
  Box box;
  std::uint32_t owner = 0;  // owners are numbered from 0
  friend bool operator==(const OwnedBox&, const OwnedBox&) = default;
};

using OwnedBoxes = std::vector<OwnedBox>;

}  // namespace slabstream
