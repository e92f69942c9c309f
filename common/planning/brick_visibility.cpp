#include "common/planning/brick_visibility.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/volume/indices.h"

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
  for (const Index3& brick : IndicesIn(CubesTouched(box, kBrick))) {
    if (AnyVisible(NumberIn(summary_.brick_counts, brick))) return true;
  }
  return false;
}

std::vector<Box> BrickVisibility::VisibleBricks(const ClipRegion& clip) const {
  const Box all = summary_.description.geometry.bounds();
  if (bricks_.empty() && layers_.empty()) return any_value_visible_ && clip.MayKeep(all) ? std::vector<Box>{all} : std::vector<Box>{};
  std::vector<Box> visible;
  for (std::size_t i = 0; i < CountIn(summary_.brick_counts); ++i) {
    if (!AnyVisible(i)) continue;
    const Index3 brick = PlaceIn(summary_.brick_counts, i);
    const Box box = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, all);
    if (clip.MayKeep(summary_.description.geometry.InDataSpace(box))) visible.push_back(box);
  }
  return visible;
}

OccupancyGrid BrickVisibility::VisibleCells() const {
  static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");
  OccupancyGrid grid{summary_.description.geometry.size, {}};
  const Index3 cells = OccupancyCells(grid.size);
  grid.cells.reserve(CountIn(cells));
  const bool known = !(bricks_.empty() && layers_.empty());
  std::vector<bool> visible(known ? CountIn(summary_.brick_counts) : 0);
  for (std::size_t brick = 0; brick < visible.size(); ++brick) visible[brick] = AnyVisible(brick);
  for (const Index3& cell : IndicesIn(cells)) {
    const bool shows = known ? visible[NumberIn(summary_.brick_counts, cell / (kBrick / kOccupancyCell))] : any_value_visible_;
    grid.cells.push_back(shows ? FullCell(OccupancyCellBox(cell, grid.size)) : CellOccupancy{});
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
