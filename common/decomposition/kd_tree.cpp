#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeKdTree(const DecompositionRequest& request) {
  const auto [second, third] = OtherAxes(request.work->size(), request.axis);
  const std::array<Axis, 3> axes = {request.axis, second, third};
  // Boxes that lie along the axis about which views turn hide nothing of each other, and each of them shows as much of what is near as of
  // what is far: all have their share of the work in most views. So it is cut first, down to boxes that hold hardly more than their halo.
  // The thinner they may be, the more alike views are; but thin boxes have more slices in all, and planes along one axis, a few slices
  // apart, halve work less exactly than planes across several.
  constexpr std::array<std::int32_t, kKdTreeShapes> kDownToHalos = {5, 2, 8};
  const std::int32_t down_to = kDownToHalos[std::size_t(request.shape)] * request.halo;
  return GrowTree(request, {.axes = axes, .first_axis_down_to = down_to, .cut_away_empty = true});
}

}  // namespace slabstream
