// BoxTree: finds those of many boxes that meet another box, without a look at each of them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

// A tree of hulls, each of which parts its boxes in two halves along its longest axis. Immutable, so any thread may ask.
class BoxTree {
 public:
  // Not null; at most 2^32 boxes.
  explicit BoxTree(std::shared_ptr<const std::vector<Box>> boxes);

  // Numbers of the boxes that have a voxel of `box`, in ascending order.
  std::vector<std::uint32_t> Meeting(const Box& box) const;

 private:
  // Of order_[begin], ..., order_[end - 1]. Its lower half is the next node, unless it has few boxes.
  struct Node {
    Box hull;
    std::uint32_t begin = 0, end = 0;
    std::uint32_t upper = 0;  // the node of the upper half; 0: it is not parted
  };
  std::uint32_t Add(std::uint32_t begin, std::uint32_t end);

  std::shared_ptr<const std::vector<Box>> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace slabstream
