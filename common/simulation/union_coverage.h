// UnionCoverage: how much of a pixel range the images of some neighbouring ranks fill together, without looking at pixels. Tile by tile,
// ranks are taken as independent: 1 - prod(1 - share).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/combining/schedule.h"
#include "common/image/coverage_map.h"

namespace slabstream {

class UnionCoverage {
 public:
  // By rank; null: shows nothing. All of a frame of width x height pixels.
  UnionCoverage(std::span<const CoverageMap* const> ranks, std::int32_t width, std::int32_t height);

  struct Amount {
    double scanned = 0;  // pixels between the first and the last tile column that is not empty
    double filled = 0;   // pixels that are not empty
    double runs = 0;     // unbroken stretches of them, row by row
    Amount& operator+=(const Amount& more);
  };
  // Of linear pixels y * width + x. A range that begins or ends within a row counts by its part of the row.
  Amount Of(RankInterval ranks, PixelRange pixels) const;

 private:
  const std::int32_t width_, height_, tiles_x_, tiles_y_;
  std::vector<double> log_empty_;  // [rank][tile]: of ranks [0, rank), the sum of log(1 - share)
};

}  // namespace slabstream
