#include "data/mosaic/box_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace slabstream {

BoxTree::BoxTree(std::shared_ptr<const std::vector<Box>> boxes) : boxes_(std::move(boxes)), order_(boxes_->size()) {
  std::iota(order_.begin(), order_.end(), std::uint32_t{0});
  if (!order_.empty()) Add(0, std::uint32_t(order_.size()));
}

std::uint32_t BoxTree::Add(std::uint32_t begin, std::uint32_t end) {
  constexpr std::uint32_t kFew = 8;
  const auto number = std::uint32_t(nodes_.size());
  Box hull;
  for (std::uint32_t i = begin; i < end; ++i) hull = Hull(hull, (*boxes_)[order_[i]]);
  nodes_.push_back({hull, begin, end});
  if (end - begin <= kFew) return number;
  const Axis longest = std::ranges::max(kAxes, {}, [&](Axis axis) { return hull.size()[axis]; });
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto place = [&](std::uint32_t box) { return std::int64_t{(*boxes_)[box].begin[longest]} + (*boxes_)[box].end[longest]; };
  std::ranges::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, {}, place);
  Add(begin, middle);
  const std::uint32_t upper = Add(middle, end);
  nodes_[number].upper = upper;
  return number;
}

std::vector<std::uint32_t> BoxTree::Meeting(const Box& box) const {
  std::vector<std::uint32_t> met, open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const std::uint32_t number = open.back();
    const Node& node = nodes_[number];
    open.pop_back();
    if (Intersection(node.hull, box).empty()) continue;
    if (node.upper != 0) {
      open.insert(open.end(), {number + 1, node.upper});
      continue;
    }
    std::copy_if(order_.begin() + node.begin, order_.begin() + node.end, std::back_inserter(met),
                 [&](std::uint32_t each) { return !Intersection((*boxes_)[each], box).empty(); });
  }
  std::ranges::sort(met);
  return met;
}

}  // namespace slabstream
