#include <utility>

#include "common/base/check.h"
#include "common/decomposition/decomposition.h"

namespace slabstream {
namespace {

struct Octree {
  std::vector<Partition::Node> nodes;
  BoxId leaves = 0;

  // Halves `box` along the axes from `axis` on, then its parts, `levels` times over; a side of one voxel is not halved. Returns the root.
  std::uint32_t Grow(const Box& box, int levels, int axis) {
    while (levels > 0 && (axis == 3 || box.size()[axis] < 2)) {
      if (axis == 3) {
        --levels;
        axis = 0;
      } else {
        ++axis;
      }
    }
    const auto number = std::uint32_t(nodes.size());
    nodes.emplace_back();
    if (levels == 0) {
      nodes[number].box = leaves++;
      return number;
    }
    const std::int32_t middle = box.begin[axis] + box.size()[axis] / 2;
    Box lower = box, upper = box;
    lower.end[axis] = upper.begin[axis] = middle;
    const std::uint32_t lower_node = Grow(lower, levels, axis + 1), upper_node = Grow(upper, levels, axis + 1);
    nodes[number] = {.leaf = false, .axis = Axis(axis), .position = middle, .lower = lower_node, .upper = upper_node};
    return number;
  }
};

}  // namespace

Partition MakeOctree(const DecompositionRequest& request) {
  CHECK_GE(request.boxes, 1);
  const Box bounds = {{0, 0, 0}, request.work->size()};
  int levels = 0;
  for (std::int64_t boxes = 1; boxes < request.boxes && 8 * boxes <= request.most_boxes; boxes *= 8) ++levels;
  Octree tree;
  tree.Grow(bounds, levels, 0);
  return {bounds, std::move(tree.nodes)};
}

}  // namespace slabstream
