// Policies to compare, made from the planner's lists, so that a new partition, balance or scheme is included automatically.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/frame/frame_request.h"

namespace slabstream {

struct NamedPolicy {
  std::string name;  // "kd-tree by occupied", or of a method
  Policy policy;     // of these functions: one group, combined by fan-in
};

// Every decomposition, divided by voxels, by bricks and by occupied voxels.
std::vector<NamedPolicy> AllPartitions();
// Three of them: the paper's, the service's own, and one by counted voxels.
NamedPolicy EqualSlabs();
NamedPolicy BrickTree();
NamedPolicy BalancedTree();
// Boxes cut along the traversal axis of the view, by occupied voxels: the least work at borders, but the most voxels to move when another
// axis becomes the traversal axis.
std::vector<NamedPolicy> PartitionsAlongTheView();
// Ways to keep workers evenly loaded while a view moves. First those that never look at a time: "slabs", the paper's; "equal", boxes of
// equal volume; "bricks", BrickTree(), and "rebuilt", BalancedTree(), cut anew when the transfer function changes. Then that tree with
// every balance that changes boxes, the compared ones too, by its name; those that hand over whole boxes get four of equal volume a worker.
std::vector<NamedPolicy> BalanceMethods();
inline constexpr int kBoxesAWorker = 4;                      // where a worker has several: with one box each there is no choice
inline constexpr std::string_view kUsualScheme = "radix-k";  // wherever boxes alone are compared
// The same policy, combined by `combine`.
Policy Combined(Policy policy, std::string_view combine, int groups = 1, std::string_view assignment = "cyclic");
// Every scheme, with its own arguments.
std::vector<std::string> AllSchemes();
// Schemes worth trying with each partition: a tree, a swap.
std::vector<std::string> UsualSchemes();

}  // namespace slabstream
