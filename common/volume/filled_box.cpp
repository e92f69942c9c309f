#include "common/volume/filled_box.h"

#include <algorithm>
#include <optional>

#include "common/volume/box_assembly.h"

namespace slabstream {

std::vector<Box> Without(std::vector<Box> boxes, std::span<const FilledBox> filled) {
  std::vector<Box> left;
  for (const FilledBox& hole : filled) {
    left.clear();
    for (const Box& box : boxes) {
      if (Intersection(box, hole.box).empty()) {
        left.push_back(box);
      } else {
        const std::vector<Box> parts = Difference(box, hole.box);
        left.insert(left.end(), parts.begin(), parts.end());
      }
    }
    boxes.swap(left);
  }
  return boxes;
}

bool FillsNoMoreThan(std::span<const FilledBox> filled, const Box& box, std::span<const FilledBox> may_be_filled) {
  if (std::ranges::equal(filled, may_be_filled)) return true;
  return std::ranges::all_of(filled, [&](const FilledBox& hole) {
    const Box part = Intersection(hole.box, box);
    return part.empty() || std::ranges::any_of(may_be_filled, [&](const FilledBox& other) { return other.box.Contains(part); });
  });
}

Index3 BlocksTogether(const Index3& block, const Index3& volume, std::size_t bytes_per_voxel, std::size_t most_bytes) {
  Index3 together = block;
  while (2 * CountIn(together) * bytes_per_voxel <= most_bytes) {
    std::optional<Axis> thinnest;
    for (const Axis axis : kAxes) {
      if (together[axis] < volume[axis] && (!thinnest || together[axis] < together[*thinnest])) thinnest = axis;
    }
    if (!thinnest) break;
    together[*thinnest] *= 2;
  }
  return together;
}

}  // namespace slabstream
