#include <algorithm>
#include <cstddef>
#include <utility>

#include "common/decomposition/partition.h"

namespace slabstream {
namespace {

// Above 0: the upper side of a plane is nearer to the eye than the lower one; below 0: the lower side is; 0: no ray crosses the plane,
// which lies between voxels position - 1 and position.
double UpperSideFirst(const Camera& camera, const Stretch& stretch, Axis axis, std::int32_t position) {
  if (camera.projection == Projection::kOrthographic) return -camera.view_direction[axis];
  return camera.eye[axis] - stretch.ToData(position - 0.5, axis);
}

}  // namespace

std::vector<BoxId> VisibilityOrder(const Partition& partition, const Camera& camera, const Stretch& stretch) {
  std::vector<BoxId> order;
  order.reserve(partition.boxes().size());
  if (partition.nodes().empty()) return order;
  std::vector<std::uint32_t> open = {0};  // nodes to visit, the nearest one last
  while (!open.empty()) {
    const Partition::Node& node = partition.nodes()[open.back()];
    open.pop_back();
    if (node.leaf) {
      order.push_back(node.box);
      continue;
    }
    std::uint32_t near = node.lower, far = node.upper;
    if (UpperSideFirst(camera, stretch, node.axis, node.position) > 0) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
  return order;
}

std::vector<TouchingBoxes> FindTouching(const Partition& partition) {
  std::vector<TouchingBoxes> touching;
  std::vector<std::uint32_t> open;
  for (BoxId id = 0; id < partition.boxes().size(); ++id) {
    const Box& box = partition.boxes()[id];
    const std::size_t before = touching.size();
    open = {0};
    while (!open.empty()) {
      const Partition::Node& node = partition.nodes()[open.back()];
      open.pop_back();
      if (node.leaf) {
        if (node.box > id) touching.push_back({id, node.box});
        continue;
      }
      if (box.begin[node.axis] <= node.position) open.push_back(node.lower);
      if (box.end[node.axis] >= node.position) open.push_back(node.upper);
    }
    std::ranges::sort(touching.begin() + std::ptrdiff_t(before), touching.end(), {}, &TouchingBoxes::second);
  }
  return touching;
}

Passage PassageBetween(const Box& first, const Box& second, const Camera& camera, const Stretch& stretch) {
  Passage passage = Passage::kNone;
  for (const Axis axis : kAxes) {
    const bool below = first.end[axis] == second.begin[axis];
    if (!below && second.end[axis] != first.begin[axis]) continue;
    const double upper_first = UpperSideFirst(camera, stretch, axis, below ? second.begin[axis] : first.begin[axis]);
    if (upper_first == 0) return Passage::kNone;
    const Passage across = (upper_first < 0) == below ? Passage::kFromFirst : Passage::kFromSecond;
    if (passage != Passage::kNone && passage != across) return Passage::kNone;  // along one axis a ray passes the other way
    passage = across;
  }
  return passage;
}

}  // namespace slabstream
