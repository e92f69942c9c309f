// Random kd-trees.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/decomposition/partition.h"
#include "tests/support/random.h"

namespace slabstream {

// At most `leaves` boxes, cut at random planes; ids are in random order.
inline Partition RandomPartition(Random& random, const Box& bounds, int leaves) {
  std::vector<Partition::Node> nodes(1);
  std::vector<std::pair<std::uint32_t, Box>> open = {{0, bounds}};
  for (int cuts = leaves - 1; cuts > 0; --cuts) {
    std::swap(open.back(), open[random.Integer<std::size_t>(0, open.size() - 1)]);
    const auto [number, box] = open.back();
    const Axis axis = kAxes[random.Integer<std::size_t>(0, 2)];
    if (box.size()[axis] < 2) continue;
    open.pop_back();
    const auto lower = std::uint32_t(nodes.size()), upper = lower + 1;
    Box low = box, high = box;
    low.end[axis] = high.begin[axis] = random.Integer(box.begin[axis] + 1, box.end[axis] - 1);
    nodes[number] = {.leaf = false, .axis = axis, .position = low.end[axis], .lower = lower, .upper = upper};
    nodes.resize(nodes.size() + 2);
    open.push_back({lower, low});
    open.push_back({upper, high});
  }
  for (std::size_t id = 0; id < open.size(); ++id) {
    std::swap(open[id], open[random.Integer(id, open.size() - 1)]);
    nodes[open[id].first].box = BoxId(id);
  }
  return Partition(bounds, std::move(nodes));
}

}  // namespace slabstream
