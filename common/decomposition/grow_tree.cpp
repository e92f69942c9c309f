#include "common/decomposition/grow_tree.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

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

// How an earlier partition was cut: a walk from its root down, past what it cut away.
class Pattern {
 public:
  Pattern() = default;
  // The first `boxes` boxes of the partition hold something.
  Pattern(const Partition& partition, std::int64_t boxes) : nodes_(partition.nodes()), filled_(nodes_.size()) { Count(0, boxes); }

  struct Cut {
    Axis axis;
    std::int64_t lower_boxes;
    std::uint32_t lower, upper;
  };
  static constexpr std::uint32_t kRoot = 0;
  // How the `boxes` >= 2 boxes below a node were divided; none if there are not as many.
  std::optional<Cut> At(std::uint32_t node, std::int64_t boxes) const {
    if (nodes_.empty() || filled_[node] != boxes) return std::nullopt;
    while (filled_[nodes_[node].lower] == 0 || filled_[nodes_[node].upper] == 0) {
      node = filled_[nodes_[node].lower] == 0 ? nodes_[node].upper : nodes_[node].lower;
    }
    return Cut{nodes_[node].axis, filled_[nodes_[node].lower], nodes_[node].lower, nodes_[node].upper};
  }

 private:
  std::int64_t Count(std::uint32_t node, std::int64_t boxes) {
    const Node& n = nodes_[node];
    return filled_[node] = n.leaf ? (n.box < boxes ? 1 : 0) : Count(n.lower, boxes) + Count(n.upper, boxes);
  }

  std::span<const Node> nodes_;
  std::vector<std::int64_t> filled_;  // boxes below each node
};

class TreeGrower {
 public:
  TreeGrower(const DecompositionRequest& request, const GrowOptions& options)
      : request_(request), options_(options), bounds_{{0, 0, 0}, request.work->size()} {
    if (request.resized != nullptr) pattern_ = Pattern(*request.resized, request.boxes);
  }

  Partition Grow() {
    CHECK_GE(request_.boxes, 1);
    const std::int64_t boxes = std::min<std::int64_t>(request_.boxes, Room(bounds_));
    GrowBox(bounds_, boxes, {}, Pattern::kRoot);
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

  // Divides `box` into `boxes` >= 1 boxes, which it has room for; returns the root. `like`: the node of the pattern to follow, if any.
  std::uint32_t GrowBox(const Box& box, std::int64_t boxes, Run run, std::uint32_t like) {
    if (options_.cut_away_empty) {
      const Box hull = Hull(box);
      if (hull.empty()) return AddLeaf(empty_);
      if (hull != box && Room(hull) >= boxes) return CutAway(box, hull, boxes, like);
    }
    if (boxes == 1) return AddLeaf(filled_);
    std::optional<Pattern::Cut> pattern = pattern_.At(like, boxes);
    if (pattern && box.size()[pattern->axis] < 2) pattern.reset();  // a single slice now
    const Axis axis = pattern ? pattern->axis : ChooseAxis(box);
    if (run.box.empty() || run.axis != axis) run = {axis, box, 0, boxes};

    std::int64_t lower_boxes = pattern ? pattern->lower_boxes : LowerHalf(boxes);
    const std::int64_t layer = Room(box) / box.size()[axis];  // boxes that one slice has room for
    const auto slices = [layer](std::int64_t count) { return std::int32_t((count + layer - 1) / layer); };
    const std::int32_t first = box.begin[axis] + slices(lower_boxes), last = box.end[axis] - slices(boxes - lower_boxes);
    std::int32_t position = PlaneAt(*request_.work, run.box, axis, run.first + lower_boxes, run.whole);
    if (first <= last) {
      position = std::clamp(position, first, last);
    } else {
      // Too crowded to halve: each side takes as many as it has room for.
      position = std::clamp(position, box.begin[axis] + 1, box.end[axis] - 1);
      const std::int64_t lower_room = layer * (position - box.begin[axis]), upper_room = layer * (box.end[axis] - position);
      lower_boxes = std::clamp(lower_boxes, boxes - upper_room, lower_room);
    }
    Run upper_run = run;
    upper_run.first += lower_boxes;
    return Cut(
        box, axis, position, [&](const Box& lower) { return GrowBox(lower, lower_boxes, run, pattern ? pattern->lower : like); },
        [&](const Box& upper) { return GrowBox(upper, boxes - lower_boxes, upper_run, pattern ? pattern->upper : like); });
  }

  // Keeps whole groups together if there are several.
  std::int64_t LowerHalf(std::int64_t boxes) const {
    const std::int64_t together = request_.together;
    return boxes > together && boxes % together == 0 ? boxes / together / 2 * together : boxes / 2;
  }

  Axis ChooseAxis(const Box& box) const {
    Axis best = options_.axes.front();
    if (box.size()[best] >= std::max(2, options_.first_axis_down_to)) return best;  // one slice cannot be cut
    for (const Axis axis : options_.axes) {
      if (box.size()[axis] > box.size()[best]) best = axis;
    }
    return best;
  }

  // The part of `box` that may own a sample: all work within the halo of it, and a halo around that. Sides that would lose little stay.
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

  std::uint32_t CutAway(const Box& box, const Box& hull, std::int64_t boxes, std::uint32_t like) {
    const auto empty = [&](const Box&) { return AddLeaf(empty_); };
    const auto rest = [&](const Box& smaller) {
      return smaller == hull ? GrowBox(hull, boxes, {}, like) : CutAway(smaller, hull, boxes, like);
    };
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
  Pattern pattern_;
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
