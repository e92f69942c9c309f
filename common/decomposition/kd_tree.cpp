#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeKdTree(const DecompositionRequest& request) {
  const auto [second, third] = OtherAxes(request.work->size(), request.axis);
  const std::array<Axis, 3> axes = {request.axis, second, third};
  // Boxes that lie along the axis about which views turn hide nothing of each other, and each of them shows as much of what is near as of
  // what is far: all have their share of the work in most views. So it is cut first, down to boxes that hold hardly more than their halo.
  return GrowTree(request, {.axes = axes, .first_axis_down_to = 4 * request.halo, .cut_away_empty = true});
}

}  // namespace slabstream
