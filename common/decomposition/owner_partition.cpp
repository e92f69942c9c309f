#include "common/decomposition/owner_partition.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/base/check.h"

namespace slabstream {
namespace {

class Divider {
 public:
  explicit Divider(const std::function<bool(const Box&)>& fits) : fits_(fits) {}

  // `owned` tile `bounds`.
  OwnerPartition Divide(const Box& bounds, std::vector<OwnedBox> owned) {
    std::vector<Partition::Node> nodes(1);
    std::vector<std::uint32_t> owners;
    std::vector<Part> open;  // lower parts last, so that boxes are numbered from below
    open.push_back({0, bounds, std::move(owned)});
    while (!open.empty()) {
      Part part = std::move(open.back());
      open.pop_back();
      const std::uint32_t owner = part.owned.front().owner;
      const bool of_one = std::ranges::all_of(part.owned, [owner](const OwnedBox& box) { return box.owner == owner; });
      if (of_one && fits_(part.region)) {
        nodes[part.node].box = BoxId(owners.size());
        owners.push_back(owner);
        continue;
      }
      if (of_one) part.owned = {{part.region, owner}};
      const auto [axis, position] = of_one ? Middle(part.region) : BestPlane(part.region, part.owned);
      const auto lower_node = std::uint32_t(nodes.size()), upper_node = lower_node + 1;
      nodes[part.node] = {.leaf = false, .axis = axis, .position = position, .lower = lower_node, .upper = upper_node};
      nodes.resize(nodes.size() + 2);
      Part lower{lower_node, part.region, {}}, upper{upper_node, part.region, {}};
      lower.region.end[axis] = upper.region.begin[axis] = position;
      for (const OwnedBox& each : part.owned) {
        if (each.box.begin[axis] < position) lower.owned.push_back({Intersection(each.box, lower.region), each.owner});
        if (each.box.end[axis] > position) upper.owned.push_back({Intersection(each.box, upper.region), each.owner});
      }
      open.push_back(std::move(upper));
      open.push_back(std::move(lower));
    }
    return {{bounds, std::move(nodes)}, std::move(owners)};
  }

 private:
  struct Part {
    std::uint32_t node = 0;
    Box region;
    std::vector<OwnedBox> owned;  // they tile it
  };
  struct Plane {
    Axis axis = Axis::kX;
    std::int32_t position = 0;
  };

  static Plane Middle(const Box& region) {
    const Index3 size = region.size();
    const Axis axis = std::ranges::max(kAxes, {}, [&](Axis a) { return size[a]; });
    CHECK_GT(size[axis], 1) << "a box of one voxel does not fit";
    return {axis, region.begin[axis] + size[axis] / 2};
  }

  // There is one: two boxes of a region have a face between them.
  static Plane BestPlane(const Box& region, const std::vector<OwnedBox>& owned) {
    // Boxes cut, boxes of the larger part, length of the cut side, less is better.
    using Rating = std::tuple<std::size_t, std::size_t, std::int32_t>;
    Rating least{owned.size() + 1, 0, 0};
    Plane best;
    for (const Axis axis : kAxes) {
      std::vector<std::int32_t> begins, ends;
      for (const OwnedBox& each : owned) {
        begins.push_back(each.box.begin[axis]);
        ends.push_back(each.box.end[axis]);
      }
      std::ranges::sort(begins);
      std::ranges::sort(ends);
      for (std::size_t i = 0; i < begins.size(); ++i) {
        const std::int32_t position = begins[i];
        if (position == region.begin[axis] || (i > 0 && begins[i - 1] == position)) continue;
        const auto below = std::size_t(std::ranges::upper_bound(ends, position) - ends.begin()), above = begins.size() - i;
        const std::size_t cut = begins.size() - below - above;
        const Rating rating{cut, std::max(below, above) + cut, -region.size()[axis]};
        if (rating >= least) continue;
        least = rating;
        best = {axis, position};
      }
    }
    CHECK_GT(best.position, region.begin[best.axis]) << "boxes of owners overlap";
    return best;
  }

  const std::function<bool(const Box&)>& fits_;
};

}  // namespace

OwnerPartition DivideByOwners(const Box& bounds, std::span<const OwnedBox> owned, const std::function<bool(const Box&)>& fits) {
  std::int64_t voxels = 0;
  for (const OwnedBox& each : owned) {
    CHECK(!each.box.empty() && bounds.Contains(each.box)) << "a box of owner " << each.owner << " is empty or reaches outside";
    voxels += each.box.voxel_count();
  }
  CHECK_EQ(voxels, bounds.voxel_count()) << "boxes of owners leave a gap, or overlap";
  return Divider(fits).Divide(bounds, {owned.begin(), owned.end()});
}

}  // namespace slabstream
