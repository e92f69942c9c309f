// OwnerPartition: a partition in which each box has one owner, for voxels that lie in boxes of any arrangement.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/decomposition/partition.h"
#include "common/volume/owned_box.h"

namespace slabstream {

struct OwnerPartition {
  Partition partition;
  std::vector<std::uint32_t> owners;  // by box
};

// Boxes are joined where those of one owner make up a part of the tree. They are cut only where no plane passes between boxes: three that
// overlap each other in turn have no order, whatever the partition. Among planes, those that cut fewest boxes come first, then those that
// part most evenly. A box of one owner that does not fit (`fits`; a box of one voxel must) is halved. CHECKs that `owned` tile `bounds`.
OwnerPartition DivideByOwners(const Box& bounds, std::span<const OwnedBox> owned, const std::function<bool(const Box&)>& fits);

}  // namespace slabstream
