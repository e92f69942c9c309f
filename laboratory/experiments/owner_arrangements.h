// Who may hold which voxels of a volume: arrangements as simulations and schedulers make them. Each is one line in OwnerArrangements(). A
// policy of the laboratory (FrameCase::policy) may name one as its assignment: the volume then lies so, and boxes stay with their owners.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "common/volume/owned_box.h"

namespace slabstream {

struct OwnerArrangement {
  std::string_view name;
  // The volume in cells, about as large as each other, that tile it: `side` of them along each axis, a power of two, or as many as it has
  // slices. By cell: its owner, in [0, owners).
  std::uint32_t (*owner)(const Index3& cell, std::uint32_t side, std::uint32_t owners);
};

const std::vector<OwnerArrangement>& OwnerArrangements();

// 32 cells for each owner, or a few more.
OwnedBoxes Arrange(const OwnerArrangement& arrangement, const Index3& size, std::uint32_t owners);

}  // namespace slabstream
