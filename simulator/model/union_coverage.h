// UnionCoverage: how much of a pixel range the images of some neighbouring ranks fill together, estimated without pixels. In each tile,
// ranks count as independent: 1 - prod(1 - share).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/combining/schedule.h"
#include "common/image/coverage_map.h"

namespace slabstream {

class UnionCoverage {
 public:
  // `ranks`: by rank; null: shows nothing. All belong to a frame of width x height pixels.
  UnionCoverage(std::span<const CoverageMap* const> ranks, std::int32_t width, std::int32_t height);

  struct Amount {
    double scanned = 0;  // pixels between the first and the last tile column that is not empty
    double filled = 0;   // pixels that are not empty
    double runs = 0;     // unbroken stretches of them, row by row
  };
  // `pixels` are numbered y * width + x. A row that lies in them only in part counts by its share.
  Amount Of(RankInterval ranks, PixelRange pixels) const;

 private:
  struct TileRow {
    double filled = 0, runs = 0;           // numbers of each row of pixels
    std::int32_t first_tile = 0, end = 0;  // tile columns that are not empty, and what lies between them
  };
  // share(x): of tile x of the row that is filled.
  template <class Share>
  TileRow Sum(Share&& share) const;
  TileRow RowOf(RankInterval ranks, std::int32_t y) const;

  const std::int32_t width_, height_, tiles_x_, tiles_y_;
  std::vector<double> log_empty_;  // [rank][tile]: of ranks [0, rank), the sum of log(1 - share)
  std::vector<TileRow> single_;    // [rank][row of tiles]: of one rank. Most questions are about these
};

}  // namespace slabstream
