// Loops over boxes whose indices are voxels, bricks, cells or zones.
#pragma once

#include <cstdint>

#include "common/volume/box.h"

namespace slabstream {

// The cubes of `side` voxels, at multiples of it, that `box` touches. The box does not begin below 0.
constexpr Box CubesTouched(const Box& box, std::int32_t side) { return {box.begin / side, CubesOver(box.end, side)}; }

// The indices in a box, x fastest: for (const Index3& v : IndicesIn(box)).
class IndicesIn {
 public:
  explicit constexpr IndicesIn(const Box& box) : box_(box) {}
  explicit constexpr IndicesIn(const Index3& size) : box_{{0, 0, 0}, size} {}

  struct Iterator {
    Box box;
    Index3 at;

    constexpr const Index3& operator*() const { return at; }
    constexpr bool operator!=(const Iterator& end) const { return at.z != end.at.z; }
    constexpr void operator++() {
      if (++at.x < box.end.x) return;
      at.x = box.begin.x;
      if (++at.y < box.end.y) return;
      at.y = box.begin.y;
      ++at.z;
    }
  };
  constexpr Iterator begin() const { return {box_, box_.begin}; }
  constexpr Iterator end() const { return {box_, {0, 0, box_.empty() ? box_.begin.z : box_.end.z}}; }

 private:
  const Box box_;
};

}  // namespace slabstream
