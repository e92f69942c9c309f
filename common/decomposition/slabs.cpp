#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/decomposition/decomposition.h"

namespace slabstream {
namespace {

// Slab i of n begins at slice i * slices / n.
struct SlabTree {
  Axis axis;
  std::int64_t slices, slabs;
  std::vector<Partition::Node> nodes;

  // The balanced tree of slabs [first, end); returns its root.
  std::uint32_t Grow(std::int64_t first, std::int64_t end) {
    const auto number = std::uint32_t(nodes.size());
    nodes.emplace_back();
    if (end - first == 1) {
      nodes[number].box = BoxId(first);
      return number;
    }
    const std::int64_t middle = (first + end) / 2;
    const std::uint32_t lower = Grow(first, middle), upper = Grow(middle, end);
    nodes[number] = {.leaf = false, .axis = axis, .position = std::int32_t(middle * slices / slabs), .lower = lower, .upper = upper};
    return number;
  }
};

}  // namespace

Partition MakeSlabs(const DecompositionRequest& request) {
  CHECK_GE(request.boxes, 1);
  const Box bounds = request.summary->description.geometry.bounds();
  const std::int64_t slices = bounds.size()[request.axis];
  SlabTree tree = {request.axis, slices, std::min<std::int64_t>(request.boxes, slices), {}};
  tree.Grow(0, tree.slabs);
  return Partition(bounds, std::move(tree.nodes));
}

}  // namespace slabstream
