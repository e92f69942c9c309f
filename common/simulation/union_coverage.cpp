#include "common/simulation/union_coverage.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace slabstream {
namespace {

// In place of log 0, so that differences of sums stay finite: less than a thousandth of a pixel of a tile stays empty.
constexpr double kLogFull = -16;

}  // namespace

UnionCoverage::Amount& UnionCoverage::Amount::operator+=(const Amount& more) {
  scanned += more.scanned;
  filled += more.filled;
  runs += more.runs;
  return *this;
}

UnionCoverage::UnionCoverage(std::span<const CoverageMap* const> ranks, std::int32_t width, std::int32_t height)
    : width_(width), height_(height), tiles_x_(OcclusionTiles(width)), tiles_y_(OcclusionTiles(height)) {
  const std::size_t tiles = std::size_t(tiles_x_) * std::size_t(tiles_y_);
  log_empty_.assign((ranks.size() + 1) * tiles, 0.0);
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    const double* before = &log_empty_[rank * tiles];
    double* after = &log_empty_[(rank + 1) * tiles];
    if (ranks[rank] == nullptr) {
      std::copy(before, before + tiles, after);
      continue;
    }
    CHECK_EQ(ranks[rank]->share.size(), tiles);
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      after[tile] = before[tile] + std::max(std::log1p(-double(ranks[rank]->share[tile])), kLogFull);
    }
  }
}

UnionCoverage::Amount UnionCoverage::Of(RankInterval ranks, PixelRange pixels) const {
  Amount amount;
  if (pixels.begin >= pixels.end) return amount;
  const std::size_t tiles = std::size_t(tiles_x_) * std::size_t(tiles_y_);
  const double* before = &log_empty_[ranks.begin * tiles];
  const double* after = &log_empty_[ranks.end * tiles];
  const double first_row = double(pixels.begin) / width_, last_row = double(pixels.end) / width_;
  std::int32_t first_tile = tiles_x_, last_tile = -1;  // columns that hold anything
  double rows_with_any = 0;
  for (std::int32_t y = std::int32_t(first_row) / kCoverageTile; y < tiles_y_ && y * kCoverageTile < last_row; ++y) {
    const double rows =
        std::min({last_row, double(height_), double(y + 1) * kCoverageTile}) - std::max(first_row, double(y) * kCoverageTile);
    bool in_stretch = false, any = false;
    for (std::int32_t x = 0; x < tiles_x_; ++x) {
      const std::size_t tile = std::size_t(y) * std::size_t(tiles_x_) + std::size_t(x);
      const double log_empty = after[tile] - before[tile];
      if (log_empty == 0) {
        in_stretch = false;
        continue;
      }
      const double columns = std::min(kCoverageTile, width_ - x * kCoverageTile);
      amount.filled += -std::expm1(log_empty) * columns * rows;
      if (!in_stretch) amount.runs += rows;
      in_stretch = any = true;
      first_tile = std::min(first_tile, x);
      last_tile = std::max(last_tile, x);
    }
    if (any) rows_with_any += rows;
  }
  if (last_tile >= first_tile) {
    amount.scanned = rows_with_any * (std::min((last_tile + 1) * kCoverageTile, width_) - first_tile * kCoverageTile);
  }
  // A range within one row of a tile row is at least one run.
  if (amount.filled > 0) amount.runs = std::max(amount.runs, 1.0);
  return amount;
}

}  // namespace slabstream
