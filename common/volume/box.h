// Box: a half-open box of voxels, [begin, end) along each axis. Slices, beams, slabs and subcubes are all boxes.
#pragma once

#include <cstdint>

#include "common/math/vec.h"

namespace slabstream {

struct Box {
  Index3 begin;  // first voxel
  Index3 end;    // one past the last voxel, by axis

  constexpr Index3 size() const { return end - begin; }
  constexpr bool empty() const { return end.x <= begin.x || end.y <= begin.y || end.z <= begin.z; }
  constexpr std::int64_t voxel_count() const { return empty() ? 0 : std::int64_t(CountIn(size())); }
  constexpr bool Contains(const Index3& v) const {
    return v.x >= begin.x && v.x < end.x && v.y >= begin.y && v.y < end.y && v.z >= begin.z && v.z < end.z;
  }
  constexpr bool Contains(const Box& b) const { return b.empty() || (Min(b.begin, begin) == begin && Max(b.end, end) == end); }
  friend constexpr bool operator==(const Box&, const Box&) = default;
  friend constexpr auto operator<=>(const Box&, const Box&) = default;
};

constexpr Box Intersection(const Box& a, const Box& b) { return {Max(a.begin, b.begin), Min(a.end, b.end)}; }

// The smallest box that holds both. An empty box adds nothing.
constexpr Box Hull(const Box& a, const Box& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {Min(a.begin, b.begin), Max(a.end, b.end)};
}

// `box` grown by `voxels` on every side and cut to `limit`: the box and its halo.
constexpr Box Grown(const Box& box, std::int32_t voxels, const Box& limit) {
  return Intersection({box.begin - Uniform(voxels), box.end + Uniform(voxels)}, limit);
}

}  // namespace slabstream
