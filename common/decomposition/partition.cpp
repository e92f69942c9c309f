#include "common/decomposition/partition.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {

Partition::Partition(const Box& bounds, std::vector<Node> nodes) : bounds_(bounds), nodes_(std::move(nodes)) {
  CHECK(!bounds_.empty() && !nodes_.empty());
  const auto leaf_count = std::size_t(std::count_if(nodes_.begin(), nodes_.end(), [](const Node& node) { return node.leaf; }));
  boxes_.resize(leaf_count);

  // Every plane cuts its box into two non-empty ones, so the leaves tile the bounds if every node is reached once and every leaf has its
  // own id.
  struct Visit {
    std::uint32_t node;
    Box box;
  };
  std::vector<Visit> open = {{0, bounds_}};
  std::vector<bool> reached(nodes_.size());
  while (!open.empty()) {
    const auto [number, box] = open.back();
    open.pop_back();
    CHECK_LT(number, nodes_.size());
    CHECK(!reached[number]) << "node " << number << " has two parents";
    reached[number] = true;
    const Node& node = nodes_[number];
    if (node.leaf) {
      CHECK_LT(node.box, leaf_count);
      CHECK(boxes_[node.box].empty()) << "box " << node.box << " has two leaves";
      boxes_[node.box] = box;
    } else {
      CHECK_GT(node.position, box.begin[node.axis]);
      CHECK_LT(node.position, box.end[node.axis]);
      Visit lower = {node.lower, box}, upper = {node.upper, box};
      lower.box.end[node.axis] = node.position;
      upper.box.begin[node.axis] = node.position;
      open.push_back(lower);
      open.push_back(upper);
    }
  }
  CHECK(std::find(reached.begin(), reached.end(), false) == reached.end()) << "a node hangs from no plane";
}

Partition Partition::OfBlocks(const Index3& block, const Box& bounds) const {
  std::vector<Node> nodes = nodes_;
  for (Node& node : nodes) node.position *= block[node.axis];
  return Partition(bounds, std::move(nodes));
}

}  // namespace slabstream
