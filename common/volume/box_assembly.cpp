#include "common/volume/box_assembly.h"

#include <utility>

namespace slabstream {

std::vector<Box> Difference(const Box& whole, const Box& hole) {
  if (whole.empty()) return {};
  Box rest = whole;  // shrinks to what both have in common
  const Box common = Intersection(whole, hole);
  if (common.empty()) return {whole};
  std::vector<Box> pieces;
  const auto keep = [&pieces](const Box& piece) {
    if (!piece.empty()) pieces.push_back(piece);
  };
  for (const Axis axis : {Axis::kZ, Axis::kY, Axis::kX}) {
    Box below = rest, above = rest;
    below.end[axis] = common.begin[axis];
    above.begin[axis] = common.end[axis];
    keep(below);
    keep(above);
    rest.begin[axis] = common.begin[axis];
    rest.end[axis] = common.end[axis];
  }
  return pieces;
}

std::int64_t BoxAssembly::missing_voxels() const {
  std::int64_t voxels = 0;
  for (const Box& box : missing) voxels += box.voxel_count();
  return voxels;
}

BoxAssembly Assemble(const Box& wanted, std::span<const Box> at_hand, std::size_t most_missing) {
  BoxAssembly assembly;
  if (!wanted.empty()) assembly.missing.push_back(wanted);
  std::vector<bool> left_out(at_hand.size());
  while (true) {
    // The box that holds most of what is missing. One copied from before holds nothing of it.
    std::size_t best = 0;
    std::int64_t most = 0;
    for (std::size_t source = 0; source < at_hand.size(); ++source) {
      if (left_out[source]) continue;
      std::int64_t voxels = 0;
      for (const Box& box : assembly.missing) voxels += Intersection(box, at_hand[source]).voxel_count();
      if (voxels <= most) continue;
      most = voxels;
      best = source;
    }
    if (most == 0) return assembly;
    std::vector<Box> missing;
    for (const Box& box : assembly.missing) {
      const std::vector<Box> rest = Difference(box, at_hand[best]);
      missing.insert(missing.end(), rest.begin(), rest.end());
    }
    left_out[best] = missing.size() > most_missing;
    if (left_out[best]) continue;
    for (const Box& box : assembly.missing) {
      const Box common = Intersection(box, at_hand[best]);
      if (!common.empty()) assembly.copied.push_back({best, common});
    }
    assembly.missing = std::move(missing);
  }
}

std::vector<Box> CutAtBlocks(const Box& box, const Index3& block) {
  std::vector<Box> pieces;
  if (box.empty()) return pieces;
  const auto first = [&](Axis axis) { return box.begin[axis] / block[axis] * block[axis]; };
  for (std::int32_t z = first(Axis::kZ); z < box.end.z; z += block.z) {
    for (std::int32_t y = first(Axis::kY); y < box.end.y; y += block.y) {
      for (std::int32_t x = first(Axis::kX); x < box.end.x; x += block.x) {
        pieces.push_back(Intersection({{x, y, z}, Index3{x, y, z} + block}, box));
      }
    }
  }
  return pieces;
}

}  // namespace slabstream
