#include "worker/renderers/raycast/empty_distance.h"

#include <algorithm>

namespace slabstream {
namespace {

// A distance transform in two sweeps over all cells, forwards and backwards, with the 26 neighbours at distance 1: exact for this distance
// (Borgefors 1986).
class Sweep {
 public:
  Sweep(const Index3& counts, std::uint8_t* distance) : counts_(counts), distance_(distance), nearest_(std::size_t(counts.x) + 2) {}

  // Updates the row's cells from the rows that the sweep has already visited: `towards` is -1 or 1 along y and z.
  void Visit(std::int32_t y, std::int32_t z, std::int32_t towards) {
    const auto width = std::size_t(counts_.x);
    std::fill(nearest_.begin(), nearest_.end(), std::uint8_t{255});
    Include(y + towards, z);
    for (std::int32_t dy = -1; dy <= 1; ++dy) Include(y + dy, z + towards);
    std::uint8_t* const row = Row(y, z);
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t around = std::min({nearest_[x], nearest_[x + 1], nearest_[x + 2]});
      row[x] = std::min(row[x], Next(around));
    }
    for (std::size_t x = 1; x < width; ++x) row[x] = std::min(row[x], Next(row[x - 1]));
    for (std::size_t x = width - 1; x-- > 0;) row[x] = std::min(row[x], Next(row[x + 1]));
  }

 private:
  static std::uint8_t Next(std::uint8_t distance) { return std::uint8_t(distance + (distance < 255 ? 1 : 0)); }
  std::uint8_t* Row(std::int32_t y, std::int32_t z) {
    return distance_ + (std::size_t(z) * std::size_t(counts_.y) + std::size_t(y)) * std::size_t(counts_.x);
  }
  void Include(std::int32_t y, std::int32_t z) {
    if (y < 0 || z < 0 || y >= counts_.y || z >= counts_.z) return;
    const std::uint8_t* const row = Row(y, z);
    for (std::size_t x = 0; x < std::size_t(counts_.x); ++x) nearest_[x + 1] = std::min(nearest_[x + 1], row[x]);
  }

  const Index3 counts_;
  std::uint8_t* const distance_;
  std::vector<std::uint8_t> nearest_;  // by column from -1 on
};

}  // namespace

std::vector<std::uint8_t> VisibleCells(const MacrocellRanges& cells, const VisibleSamples& visible) {
  std::vector<std::uint8_t> distance(cells.ranges.size() + kEmptyDistancePadding, 255);
  for (std::size_t i = 0; i < cells.ranges.size(); ++i) {
    if (visible.AnyBetween(cells.ranges[i].min, cells.ranges[i].max)) distance[i] = 0;
  }
  return distance;
}

std::vector<std::uint8_t> EmptyDistances(const MacrocellRanges& cells, const VisibleSamples& visible) {
  return EmptyDistances(cells.counts, VisibleCells(cells, visible));
}

std::vector<std::uint8_t> EmptyDistances(const Index3& counts, std::vector<std::uint8_t> distance) {
  const auto visible = std::size_t(std::ranges::count(distance, 0));
  if (visible == 0 || visible == CountIn(counts)) return distance;  // as in most boxes of a large volume
  Sweep sweep(counts, distance.data());
  for (std::int32_t z = 0; z < counts.z; ++z) {
    for (std::int32_t y = 0; y < counts.y; ++y) sweep.Visit(y, z, -1);
  }
  for (std::int32_t z = counts.z; z-- > 0;) {
    for (std::int32_t y = counts.y; y-- > 0;) sweep.Visit(y, z, 1);
  }
  return distance;
}

}  // namespace slabstream
