#include "common/planning/level_partition.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>

#include "common/volume/indices.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostShown = std::size_t{1} << 16;

struct Cut {
  Axis axis = Axis::kX;
  std::int32_t position = 0;
};

// Numbers of zones by level; the last one: of those outside.
using Counts = std::vector<std::int64_t>;

std::int64_t Minority(std::span<const std::int64_t> counts) {
  std::int64_t all = 0, most = 0;
  for (const std::int64_t count : counts) {
    all += count;
    most = std::max(most, count);
  }
  return all - most;
}

class Divider {
 public:
  explicit Divider(const LevelPartitionRequest& request) : request_(request), map_(*request.map) {}

  LevelPartition Divide() {
    const Box bounds = {{0, 0, 0}, request_.size};
    nodes_.resize(1);
    PartLevels(bounds);
    std::size_t shown = leaves_.size();
    while (!leaves_.empty() && shown < kMostShown) {
      const Leaf largest = leaves_.top();
      if (largest.bytes <= request_.most_bytes && shown >= std::size_t(request_.least_boxes)) break;
      leaves_.pop();
      const std::optional<Cut> cut = Middle(largest);
      if (!cut) {
        done_.push_back(largest);
        if (largest.bytes > request_.most_bytes) continue;
        break;  // the others are no larger
      }
      const auto [lower, upper] = Split(largest.node, largest.box, *cut);
      Keep(lower.node, lower.box, largest.level);
      Keep(upper.node, upper.box, largest.level);
      ++shown;
    }
    return Finish(bounds);
  }

 private:
  struct Leaf {
    std::int64_t bytes = 0;
    std::uint32_t node = 0;
    Box box;
    std::uint8_t level = 0;
    // Which one is divided next: the largest, or the first of them.
    friend bool operator<(const Leaf& a, const Leaf& b) { return std::tuple(a.bytes, b.node) < std::tuple(b.bytes, a.node); }
  };
  struct Part {
    std::uint32_t node = 0;
    Box box;
  };

  // Zones whose voxels begin in the box, which ends between zones.
  Box ZonesIn(const Box& box) const {
    Box zones;
    for (const Axis axis : kAxes) {
      zones.begin[axis] = box.begin[axis] / map_.side[axis];
      zones.end[axis] = (box.end[axis] - 1) / map_.side[axis] + 1;
    }
    return zones;
  }

  // The plane between zones that leaves the fewest zones among those of another level; of equal ones, the one that halves best. None: all
  // zones are of one level.
  std::optional<Cut> BetweenLevels(const Box& box) const {
    const Box zones = ZonesIn(box);
    const std::size_t kinds = map_.levels.size() + 1;
    const auto kind = [&](const Index3& zone) { return map_.Of(zone) == LevelMap::kOutside ? kinds - 1 : map_.Of(zone); };
    Counts all(kinds);
    for (const Index3& zone : IndicesIn(zones)) ++all[kind(zone)];
    if (Minority(all) == 0) return std::nullopt;
    std::optional<Cut> best;
    auto least = std::tuple(std::numeric_limits<std::int64_t>::max(), std::int64_t{0});
    for (const Axis axis : kAxes) {
      const auto count = std::size_t(zones.size()[axis]);
      Counts slices(count * kinds), below(kinds), above = all;
      for (const Index3& zone : IndicesIn(zones)) ++slices[std::size_t(zone[axis] - zones.begin[axis]) * kinds + kind(zone)];
      for (std::size_t i = 0; i + 1 < count; ++i) {
        for (std::size_t level = 0; level < kinds; ++level) {
          below[level] += slices[i * kinds + level];
          above[level] -= slices[i * kinds + level];
        }
        const auto unequal = std::int64_t(i + 1) - std::int64_t(count - i - 1);
        const std::tuple left = {Minority(below) + Minority(above), std::abs(unequal) - std::int64_t(count)};
        if (left >= least) continue;
        least = left;
        best = {axis, (zones.begin[axis] + std::int32_t(i) + 1) * map_.side[axis]};
      }
    }
    return best;
  }

  // Zones of several levels, as one box of the finest one.
  struct Mixed {
    std::int64_t waste = 0;  // bytes of it beyond those of each zone at its own level
    Part part;
    // Which one is parted next: that of the most waste, or the first of them.
    friend bool operator<(const Mixed& a, const Mixed& b) { return std::tuple(a.waste, b.part.node) < std::tuple(b.waste, a.part.node); }
  };

  std::uint8_t FinestIn(const Box& zones) const {
    std::uint8_t finest = LevelMap::kOutside;
    for (const Index3& zone : IndicesIn(zones)) finest = std::min(finest, map_.Of(zone));
    return finest;
  }

  Mixed MixedOf(const Part& part) const {
    const Box zones = ZonesIn(part.box);
    const std::uint8_t finest = FinestIn(zones);
    if (finest == LevelMap::kOutside) return {0, part};
    std::int64_t needed = 0;
    for (const Index3& zone : IndicesIn(zones)) {
      if (map_.Of(zone) != LevelMap::kOutside) needed += request_.bytes_of({map_.BoxOf(zone, request_.size), map_.Of(zone)});
    }
    // Zones have borders of their own, so together they may take more than the box.
    return {std::max<std::int64_t>(request_.bytes_of({part.box, finest}) - needed, 0) + 1, part};
  }

  // Each box takes time of its own, and a plan of one worker has at most kMaxGroups boxes, too large ones halved. So where levels lie in
  // many small parts, as in adaptive meshes, boxes hold zones of several levels, and are drawn from the finest of them. What limits this is
  // the same for any number of workers with any memory, and so are pictures.
  void PartLevels(const Box& bounds) {
    constexpr std::size_t kMostParts = 768;
    std::priority_queue<Mixed> mixed;
    mixed.push(MixedOf({0, bounds}));
    while (!mixed.empty()) {
      const Part part = mixed.top().part;
      mixed.pop();
      const bool full = mixed.size() + leaves_.size() + 1 >= kMostParts;
      const std::optional<Cut> cut = full ? std::nullopt : BetweenLevels(part.box);
      if (!cut) {
        Keep(part.node, part.box, FinestIn(ZonesIn(part.box)));
        continue;
      }
      const auto [lower, upper] = Split(part.node, part.box, *cut);
      mixed.push(MixedOf(lower));
      mixed.push(MixedOf(upper));
    }
  }

  void Keep(std::uint32_t node, const Box& box, std::uint8_t level) {
    Leaf leaf{0, node, box, level};
    if (level == LevelMap::kOutside) return done_.push_back(leaf);
    leaf.bytes = request_.bytes_of({box, level});
    leaves_.push(leaf);
  }

  // Of a leaf's longest side: between two zones, or two blocks, or else in the middle. None: it is one voxel.
  std::optional<Cut> Middle(const Leaf& leaf) const {
    const Box& box = leaf.box;
    Axis axis = Axis::kX;
    for (const Axis other : kAxes) {
      if (box.size()[other] > box.size()[axis]) axis = other;
    }
    const std::int32_t middle = box.begin[axis] + box.size()[axis] / 2;
    if (middle == box.begin[axis]) return std::nullopt;
    for (const std::int32_t unit : {map_.side[axis], request_.blocks_of(leaf.level)[axis]}) {
      if (unit < 1) continue;
      const std::int32_t position = (middle + unit / 2) / unit * unit;
      if (position > box.begin[axis] && position < box.end[axis]) return Cut{axis, position};
    }
    return Cut{axis, middle};
  }

  std::pair<Part, Part> Split(std::uint32_t node, const Box& box, const Cut& cut) {
    const auto lower = std::uint32_t(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node] = {false, cut.axis, cut.position, lower, lower + 1, 0};
    std::pair<Part, Part> parts = {{lower, box}, {lower + 1, box}};
    parts.first.box.end[cut.axis] = parts.second.box.begin[cut.axis] = cut.position;
    return parts;
  }

  // Numbers the leaves in the order of the tree.
  LevelPartition Finish(const Box& bounds) {
    for (; !leaves_.empty(); leaves_.pop()) done_.push_back(leaves_.top());
    std::vector<std::uint8_t> of_node(nodes_.size());
    for (const Leaf& leaf : done_) of_node[leaf.node] = leaf.level;
    LevelPartition made;
    std::vector<std::uint32_t> open = {0};
    while (!open.empty()) {
      const std::uint32_t number = open.back();
      open.pop_back();
      Partition::Node& node = nodes_[number];
      if (node.leaf) {
        node.box = BoxId(made.levels.size());
        made.levels.push_back(of_node[number]);
      } else {
        open.push_back(node.upper);
        open.push_back(node.lower);
      }
    }
    made.partition = Partition(bounds, std::move(nodes_));
    return made;
  }

  const LevelPartitionRequest& request_;
  const LevelMap& map_;
  std::vector<Partition::Node> nodes_;
  std::priority_queue<Leaf> leaves_;
  std::vector<Leaf> done_;
};

}  // namespace

LevelPartition DivideByLevels(const LevelPartitionRequest& request) { return Divider(request).Divide(); }

}  // namespace slabstream
