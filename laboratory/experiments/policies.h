// Policies to compare, made from the lists of the planner, so that a new partition or scheme takes part by itself.
#pragma once

#include <string>
#include <vector>

#include "common/frame/frame_request.h"
#include "common/simulation/timeline.h"

namespace slabstream {

struct NamedPolicy {
  std::string name;  // "kd-tree by occupied"
  Policy policy;     // one group
};

// Every decomposition, divided by voxels and by occupied voxels.
std::vector<NamedPolicy> AllPartitions();
// Two of them: what the paper does, and what is meant to balance.
NamedPolicy EqualSlabs();
NamedPolicy BalancedTree();
// Boxes cut along the axis on which the view's slices are traversed, by occupied voxels: what is rendered at borders is least, and what
// travels when another axis comes nearest is most.
std::vector<NamedPolicy> PartitionsAlongTheView();
// Every scheme, with its own arguments.
std::vector<std::string> AllSchemes();
// Those that are worth trying with each partition: a tree, a swap.
std::vector<std::string> UsualSchemes();

}  // namespace slabstream
