// Box: a half-open box of voxels, [begin, end) along each axis. Slices, beams, slabs and subcubes are all boxes.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/math/vec.h"

namespace slabstream {

struct Box {
  Index3 begin;  // first voxel
  Index3 end;    // one past the last voxel, by axis

  constexpr Index3 size() const { return {end.x - begin.x, end.y - begin.y, end.z - begin.z}; }
  constexpr bool empty() const { return end.x <= begin.x || end.y <= begin.y || end.z <= begin.z; }
  constexpr std::int64_t voxel_count() const {
    return empty() ? 0 : std::int64_t{1} * (end.x - begin.x) * (end.y - begin.y) * (end.z - begin.z);
  }
  constexpr bool Contains(const Index3& v) const {
    return v.x >= begin.x && v.x < end.x && v.y >= begin.y && v.y < end.y && v.z >= begin.z && v.z < end.z;
  }
  constexpr bool Contains(const Box& b) const {
    return b.empty() || (b.begin.x >= begin.x && b.begin.y >= begin.y && b.begin.z >= begin.z && b.end.x <= end.x && b.end.y <= end.y &&
                         b.end.z <= end.z);
  }
  friend constexpr bool operator==(const Box&, const Box&) = default;
  friend constexpr auto operator<=>(const Box&, const Box&) = default;
};

constexpr Box Intersection(const Box& a, const Box& b) {
  return {{std::max(a.begin.x, b.begin.x), std::max(a.begin.y, b.begin.y), std::max(a.begin.z, b.begin.z)},
          {std::min(a.end.x, b.end.x), std::min(a.end.y, b.end.y), std::min(a.end.z, b.end.z)}};
}

// The smallest box that holds both. An empty box adds nothing.
constexpr Box Hull(const Box& a, const Box& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {{std::min(a.begin.x, b.begin.x), std::min(a.begin.y, b.begin.y), std::min(a.begin.z, b.begin.z)},
          {std::max(a.end.x, b.end.x), std::max(a.end.y, b.end.y), std::max(a.end.z, b.end.z)}};
}

// `box` grown by `voxels` on every side and cut to `limit`: the box and its halo.
constexpr Box Grown(const Box& box, std::int32_t voxels, const Box& limit) {
  return Intersection(
      {{box.begin.x - voxels, box.begin.y - voxels, box.begin.z - voxels}, {box.end.x + voxels, box.end.y + voxels, box.end.z + voxels}},
      limit);
}

}  // namespace slabstream
