#include <utility>

#include "common/decomposition/partition.h"

namespace slabstream {
namespace {

// True if the upper side of a plane is nearer to the eye than the lower one. The plane lies between voxels position - 1 and position.
bool UpperSideFirst(const Camera& camera, const Stretch& stretch, Axis axis, std::int32_t position) {
  if (camera.projection == Projection::kOrthographic) return camera.view_direction[axis] < 0;
  return camera.eye[axis] > stretch.ToData(position - 0.5, axis);
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
    if (UpperSideFirst(camera, stretch, node.axis, node.position)) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
  return order;
}

}  // namespace slabstream
