#include "common/decomposition/grow_tree.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

using Node = Partition::Node;

// Boxes [first, first + n) of `whole` that `box` was cut into along `axis`.
struct Run {
  Axis axis;
  Box box;
  std::int64_t first = 0, whole = 1;
};

class TreeGrower {
 public:
  TreeGrower(const DecompositionRequest& request, const GrowOptions& options)
      : request_(request), options_(options), bounds_{{0, 0, 0}, request.work->size()} {}

  Partition Grow() {
    CHECK_GE(request_.boxes, 1);
    const std::int64_t boxes = std::min<std::int64_t>(request_.boxes, Room(bounds_));
    GrowBox(bounds_, boxes, {});
    BoxId id = 0;
    for (const std::uint32_t leaf : filled_) nodes_[leaf].box = id++;
    for (const std::uint32_t leaf : empty_) nodes_[leaf].box = id++;
    return {bounds_, std::move(nodes_)};
  }

 private:
  // Boxes that there is room for.
  std::int64_t Room(const Box& box) const {
    std::int64_t room = 1;
    for (const Axis axis : options_.axes) room *= box.size()[axis];
    return room;
  }

  std::uint32_t AddLeaf(std::vector<std::uint32_t>& leaves) {
    leaves.push_back(std::uint32_t(nodes_.size()));
    nodes_.emplace_back();
    return leaves.back();
  }

  // Cuts `box` at a plane; the functions grow the two parts, the lower one first. Returns the node.
  template <class Lower, class Upper>
  std::uint32_t Cut(const Box& box, Axis axis, std::int32_t position, Lower&& grow_lower, Upper&& grow_upper) {
    const auto number = std::uint32_t(nodes_.size());
    nodes_.emplace_back();
    Box lower = box, upper = box;
    lower.end[axis] = upper.begin[axis] = position;
    const std::uint32_t lower_node = grow_lower(lower), upper_node = grow_upper(upper);
    nodes_[number] = {.leaf = false, .axis = axis, .position = position, .lower = lower_node, .upper = upper_node};
    return number;
  }

  // The root of `boxes` >= 1 boxes in `box`, which has room for them.
  std::uint32_t GrowBox(const Box& box, std::int64_t boxes, Run run) {
    if (options_.cut_away_empty) {
      const Box hull = Hull(box);
      if (hull.empty()) return AddLeaf(empty_);
      if (hull != box && Room(hull) >= boxes) return CutAway(box, hull, boxes);
    }
    if (boxes == 1) return AddLeaf(filled_);
    const Axis axis = ChooseAxis(box);
    if (run.box.empty() || run.axis != axis) run = {axis, box, 0, boxes};

    std::int64_t lower_boxes = LowerHalf(boxes);
    const std::int64_t layer = Room(box) / box.size()[axis];  // boxes that one slice has room for
    const auto slices = [layer](std::int64_t count) { return std::int32_t((count + layer - 1) / layer); };
    const std::int32_t first = box.begin[axis] + slices(lower_boxes), last = box.end[axis] - slices(boxes - lower_boxes);
    std::int32_t position = PlaneAt(*request_.work, run.box, axis, run.first + lower_boxes, run.whole);
    if (first <= last) {
      position = std::clamp(position, first, last);
    } else {
      // Too crowded to halve: as many as there is room for on either side.
      position = std::clamp(position, box.begin[axis] + 1, box.end[axis] - 1);
      const std::int64_t lower_room = layer * (position - box.begin[axis]), upper_room = layer * (box.end[axis] - position);
      lower_boxes = std::clamp(lower_boxes, boxes - upper_room, lower_room);
    }
    Run upper_run = run;
    upper_run.first += lower_boxes;
    return Cut(
        box, axis, position, [&](const Box& lower) { return GrowBox(lower, lower_boxes, run); },
        [&](const Box& upper) { return GrowBox(upper, boxes - lower_boxes, upper_run); });
  }

  // Whole groups stay together, as far as there are several.
  std::int64_t LowerHalf(std::int64_t boxes) const {
    const std::int64_t together = request_.together;
    return boxes > together && boxes % together == 0 ? boxes / together / 2 * together : boxes / 2;
  }

  Axis ChooseAxis(const Box& box) const {
    Axis best = options_.axes.front();
    if (box.size()[best] >= options_.first_axis_down_to) return best;
    for (const Axis axis : options_.axes) {
      if (box.size()[axis] > box.size()[best]) best = axis;
    }
    return best;
  }

  // What of `box` may own a sample: all work within the halo of it, and a halo around that. Sides where little would be cut off stay.
  Box Hull(const Box& box) const {
    const Box work = request_.work->Hull(Grown(box, request_.halo, bounds_));
    if (work.empty()) return {};
    Box hull = Grown(work, request_.halo, box);
    if (hull.empty()) return {};
    for (const Axis axis : kAxes) {
      if (hull.begin[axis] - box.begin[axis] < kLeastCut) hull.begin[axis] = box.begin[axis];
      if (box.end[axis] - hull.end[axis] < kLeastCut) hull.end[axis] = box.end[axis];
    }
    return hull;
  }

  std::uint32_t CutAway(const Box& box, const Box& hull, std::int64_t boxes) {
    const auto empty = [&](const Box&) { return AddLeaf(empty_); };
    const auto rest = [&](const Box& smaller) { return smaller == hull ? GrowBox(hull, boxes, {}) : CutAway(smaller, hull, boxes); };
    for (const Axis axis : kAxes) {
      if (hull.begin[axis] > box.begin[axis]) return Cut(box, axis, hull.begin[axis], empty, rest);
      if (hull.end[axis] < box.end[axis]) return Cut(box, axis, hull.end[axis], rest, empty);
    }
    CHECK(false) << "nothing to cut away";
    return 0;
  }

  const DecompositionRequest& request_;
  const GrowOptions& options_;
  const Box bounds_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> filled_, empty_;  // leaves, in the order of the tree
};

}  // namespace

Partition GrowTree(const DecompositionRequest& request, const GrowOptions& options) { return TreeGrower(request, options).Grow(); }

std::array<Axis, 2> OtherAxes(const Index3& size, Axis axis) {
  std::array<Axis, 2> others{};
  std::copy_if(kAxes.begin(), kAxes.end(), others.begin(), [axis](Axis other) { return other != axis; });
  if (size[others[1]] > size[others[0]]) std::swap(others[0], others[1]);
  return others;
}

}  // namespace slabstream
