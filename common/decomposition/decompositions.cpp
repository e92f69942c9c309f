#include "common/decomposition/grow_tree.h"

namespace slabstream {

Partition MakeSlabs(const DecompositionRequest& request) { return GrowTree(request, {.axes = {&request.axis, 1}}); }

Partition MakeBeams(const DecompositionRequest& request) {
  const std::array<Axis, 2> axes = {request.axis, OtherAxes(request.work->size(), request.axis)[0]};
  return GrowTree(request, {.axes = axes});
}

Partition MakeSubcubes(const DecompositionRequest& request) {
  const auto [second, third] = OtherAxes(request.work->size(), request.axis);
  const std::array<Axis, 3> axes = {request.axis, second, third};
  return GrowTree(request, {.axes = axes});
}

Partition MakeKdTree(const DecompositionRequest& request) {
  const auto [second, third] = OtherAxes(request.work->size(), request.axis);
  const std::array<Axis, 3> axes = {request.axis, second, third};
  // Boxes stacked along the axis that views turn about do not hide each other, and each contains as much near as far material, so all have
  // their share of the work in most views. So this axis is cut first, down to boxes of a few halos. Thinner boxes make views more alike,
  // but they have more slices in all, and planes a few slices apart along one axis halve work less exactly than planes across several.
  constexpr std::array<std::int32_t, kKdTreeShapes> kDownToHalos = {5, 2, 8};
  const std::int32_t down_to = kDownToHalos[std::size_t(request.shape)] * request.halo;
  return GrowTree(request, {.axes = axes, .first_axis_down_to = down_to, .cut_away_empty = true});
}

const std::vector<DecompositionEntry>& Decompositions() {
  static const std::vector<DecompositionEntry> entries = {
      {"slab", "slabs of slices along --axis", MakeSlabs, "voxels", true},
      {"beam", "boxes cut along two axes, --axis first", MakeBeams, "voxels", false},
      {"subcube", "boxes cut along all three axes", MakeSubcubes, "voxels", false},
      {"octree", "octants of octants, at least as many as requested", MakeOctree, "voxels", false},
      {"kd-tree", "boxes that fit tightly round occupied voxels, with empty space cut away", MakeKdTree, "bricks", false, kKdTreeShapes},
  };
  return entries;
}

}  // namespace slabstream
