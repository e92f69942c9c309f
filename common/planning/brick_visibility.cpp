#include "common/planning/brick_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace slabstream {
namespace {

// Much less than a bin, so that a background in the bin below the first visible one counts as empty.
constexpr double kSlackBins = 1.0 / 16;

}  // namespace

BrickVisibility::BrickVisibility(const VolumeSummary& summary, const BrickRangeList& bricks, ClassificationTable drawn,
                                 std::vector<std::uint8_t> layers)
    : summary_(summary), bricks_(bricks), table_(std::move(drawn)), layers_(std::move(layers)), next_visible_(table_.opacity.size()) {
  int next = table_.size();
  for (int bin = table_.size() - 1; bin >= 0; --bin) {
    if (table_.opacity[std::size_t(bin)] > 0) next = bin;
    next_visible_[std::size_t(bin)] = next;
  }
  any_value_visible_ = Visible(AnyValue(summary.description));
}

bool BrickVisibility::AnyVisible(const Box& box) const {
  if (bricks_.empty() && layers_.empty()) return any_value_visible_;
  const auto brick_of = [](std::int32_t voxel) { return voxel / kBrick; };
  for (std::int32_t z = brick_of(box.begin.z); z <= brick_of(box.end.z - 1); ++z) {
    for (std::int32_t y = brick_of(box.begin.y); y <= brick_of(box.end.y - 1); ++y) {
      const std::size_t row = NumberIn(summary_.brick_counts, {0, y, z});
      for (std::int32_t x = brick_of(box.begin.x); x <= brick_of(box.end.x - 1); ++x) {
        if (AnyVisible(row + std::size_t(x))) return true;
      }
    }
  }
  return false;
}

std::vector<Box> BrickVisibility::VisibleBricks(const ClipRegion& clip) const {
  const Box all = summary_.description.geometry.bounds();
  if (bricks_.empty()) return any_value_visible_ && clip.MayKeep(all) ? std::vector<Box>{all} : std::vector<Box>{};
  std::vector<Box> visible;
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    if (!AnyVisible(i)) continue;
    const Index3 brick = PlaceIn(summary_.brick_counts, i);
    const Box box = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, all);
    if (clip.MayKeep(box)) visible.push_back(box);
  }
  return visible;
}

OccupancyGrid BrickVisibility::VisibleCells() const {
  static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");
  OccupancyGrid grid{summary_.description.geometry.size, {}};
  const Index3 cells = OccupancyCells(grid.size);
  grid.cells.reserve(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z));
  for (Index3 cell; cell.z < cells.z; ++cell.z) {
    for (cell.y = 0; cell.y < cells.y; ++cell.y) {
      for (cell.x = 0; cell.x < cells.x; ++cell.x) {
        const Box box = OccupancyCellBox(cell, grid.size);
        grid.cells.push_back(AnyVisible(box) ? FullCell(box) : CellOccupancy{});
      }
    }
  }
  return grid;
}

bool BrickVisibility::Visible(const ValueRange& brick) const {
  if (brick.min > brick.max) return false;
  // The range was rounded to float. The slack is for the way back to stored samples, and for kernels that find bins in single precision.
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const double a = StoredFromData(double(std::nextafter(brick.min, -kInfinity)));
  const double b = StoredFromData(double(std::nextafter(brick.max, kInfinity)));
  const double slack = kSlackBins / table_.bin_from_stored_scale;
  return next_visible_[std::size_t(table_.BinOf(std::min(a, b) - slack))] <= table_.BinOf(std::max(a, b) + slack);
}

double BrickVisibility::StoredFromData(double value) const {
  const ValueMapping& mapping = summary_.description.mapping;
  return mapping.scale == 0 ? 0 : (value - mapping.offset) / mapping.scale;  // a scale of 0: every sample has the same value
}

}  // namespace slabstream
