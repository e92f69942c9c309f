// LevelMap: which level each part of a volume is drawn from in one picture. Parts are zones of a regular grid. It is a function of the
// request and the volume's levels alone, whoever draws it with however much memory.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/box.h"

namespace slabstream {

struct LevelMap {
  static constexpr std::uint8_t kOutside = 255;  // a zone that the picture does not show

  // Levels of the dataset, finest first; not empty. The voxels of the first one are the frame's grid.
  std::vector<int> levels = {0};
  Index3 side;                        // side in voxels of that grid, by axis; the last zones may be cut off
  Index3 counts;                      // zones by axis (IndicesIn)
  std::vector<std::uint8_t> of_zone;  // index into `levels`, or kOutside; x fastest. Empty: all is drawn from the first level

  bool one_level() const { return of_zone.empty(); }
  // The zone's voxels; `size`: of the grid.
  Box BoxOf(const Index3& number, const Index3& size) const {
    const Index3 begin = {number.x * side.x, number.y * side.y, number.z * side.z};
    return {begin, Min(begin + side, size)};
  }
  std::uint8_t Of(const Index3& number) const { return of_zone[NumberIn(counts, number)]; }
  friend bool operator==(const LevelMap&, const LevelMap&) = default;
};

}  // namespace slabstream
