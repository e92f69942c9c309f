#include "simulator/model/union_coverage.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace slabstream {
namespace {

// In place of log 0, so that differences of sums stay finite: less than a thousandth of a pixel of a tile stays empty.
constexpr double kLogFull = -16;

}  // namespace

UnionCoverage::UnionCoverage(std::span<const CoverageMap* const> ranks, std::int32_t width, std::int32_t height)
    : width_(width), height_(height), tiles_x_(CoverageTiles(width)), tiles_y_(CoverageTiles(height)) {
  const std::size_t tiles = std::size_t(tiles_x_) * std::size_t(tiles_y_);
  log_empty_.assign((ranks.size() + 1) * tiles, 0.0);
  single_.resize(ranks.size() * std::size_t(tiles_y_));
  for (std::size_t rank = 0; rank < ranks.size(); ++rank) {
    const double* before = &log_empty_[rank * tiles];
    double* after = &log_empty_[(rank + 1) * tiles];
    if (ranks[rank] == nullptr) {
      std::copy(before, before + tiles, after);
      continue;
    }
    const CoverageMap& map = *ranks[rank];
    CHECK_EQ(map.share.size(), tiles);
    for (std::size_t tile = 0; tile < tiles; ++tile) {
      after[tile] = before[tile] + std::max(std::log1p(-double(map.share[tile])), kLogFull);
    }
    for (std::int32_t y = 0; y < tiles_y_; ++y) {
      single_[rank * std::size_t(tiles_y_) + std::size_t(y)] = Sum([&](std::int32_t x) { return double(map.at(x, y)); });
    }
  }
}

template <class Share>
UnionCoverage::TileRow UnionCoverage::Sum(Share&& share) const {
  TileRow row{.first_tile = tiles_x_};
  for (std::int32_t x = 0; x < tiles_x_; ++x) {
    const double filled = share(x);
    if (filled == 0) continue;
    row.filled += filled * std::min(kCoverageTile, width_ - x * kCoverageTile);
    if (row.end != x || x == 0) row.runs += 1;
    row.first_tile = std::min(row.first_tile, x);
    row.end = x + 1;
  }
  return row;
}

UnionCoverage::TileRow UnionCoverage::RowOf(RankInterval ranks, std::int32_t y) const {
  if (ranks.end == ranks.begin + 1) return single_[ranks.begin * std::size_t(tiles_y_) + std::size_t(y)];
  const std::size_t tiles = std::size_t(tiles_x_) * std::size_t(tiles_y_), first = std::size_t(y) * std::size_t(tiles_x_);
  const double* before = &log_empty_[ranks.begin * tiles + first];
  const double* after = &log_empty_[ranks.end * tiles + first];
  return Sum([&](std::int32_t x) { return after[x] == before[x] ? 0.0 : -std::expm1(after[x] - before[x]); });
}

UnionCoverage::Amount UnionCoverage::Of(RankInterval ranks, PixelRange pixels) const {
  Amount amount;
  if (pixels.begin >= pixels.end) return amount;
  const double first_row = double(pixels.begin) / width_, last_row = double(pixels.end) / width_;
  std::int32_t first_tile = tiles_x_, end_tile = 0;
  double rows_with_any = 0;
  for (std::int32_t y = std::int32_t(first_row) / kCoverageTile; y < tiles_y_ && y * kCoverageTile < last_row; ++y) {
    const double rows =
        std::min({last_row, double(height_), double(y + 1) * kCoverageTile}) - std::max(first_row, double(y) * kCoverageTile);
    const TileRow row = RowOf(ranks, y);
    if (row.end == 0) continue;
    amount.filled += row.filled * rows;
    amount.runs += row.runs * rows;
    rows_with_any += rows;
    first_tile = std::min(first_tile, row.first_tile);
    end_tile = std::max(end_tile, row.end);
  }
  if (first_tile < end_tile) amount.scanned = rows_with_any * (std::min(end_tile * kCoverageTile, width_) - first_tile * kCoverageTile);
  // A range within one row of a tile row is at least one run.
  if (amount.filled > 0) amount.runs = std::max(amount.runs, 1.0);
  return amount;
}

}  // namespace slabstream
