// Policies to compare, made from the planner's lists, so that a new partition or scheme is included automatically.
#pragma once

#include <string>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

struct NamedPolicy {
  std::string name;  // "kd-tree by occupied"
  Policy policy;     // one group
};

// Every decomposition, divided by voxels and by occupied voxels.
std::vector<NamedPolicy> AllPartitions();
// Three of them: the paper's, and two meant to balance.
NamedPolicy EqualSlabs();
NamedPolicy BalancedSlabs();
NamedPolicy BalancedTree();
// Boxes cut along the traversal axis of the view, by occupied voxels: the least work at borders, but the most voxels to move when another
// axis becomes the traversal axis.
std::vector<NamedPolicy> PartitionsAlongTheView();
// Every scheme, with its own arguments.
std::vector<std::string> AllSchemes();
// Schemes worth trying with each partition: a tree, a swap.
std::vector<std::string> UsualSchemes();

}  // namespace slabstream
