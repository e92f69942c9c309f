#include "common/classification/count_occupied.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/base/check.h"
#include "common/classification/occupancy_layers.h"
#include "common/parallel/parallel.h"

namespace slabstream {
namespace {

static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");

// Whether a sample is occupied, 0 or 1: of integers by table.
template <class T>
class Occupied {
 public:
  explicit Occupied(const ClassificationTable& table) : table_(table) {
    if constexpr (std::is_integral_v<T>) {
      by_sample_.resize(std::size_t{std::numeric_limits<T>::max()} + 1);
      for (std::size_t sample = 0; sample < by_sample_.size(); ++sample) by_sample_[sample] = Visible(double(sample));
    }
  }

  std::uint8_t operator()(T sample) const {
    if constexpr (std::is_integral_v<T>) {
      return by_sample_[sample];
    } else {
      return std::uint8_t(std::isfinite(sample) && Visible(double(sample)));
    }
  }

 private:
  bool Visible(double sample) const { return table_.opacity[std::size_t(table_.BinOf(sample))] > 0; }

  const ClassificationTable& table_;
  std::vector<std::uint8_t> by_sample_;
};

// What the volume's summary tells of its bricks.
class KnownBricks {
 public:
  KnownBricks(const ClassificationTable& table, const VolumeSummary* summary) : table_(table), summary_(summary) {
    if (summary_ == nullptr || summary_->bricks.empty()) return;
    visible_before_.push_back(0);
    for (const float opacity : table.opacity) visible_before_.push_back(visible_before_.back() + int(opacity > 0));
  }

  // Whether all voxels of a brick are occupied, or none is. None: it must be read.
  std::optional<bool> AllOf(const Index3& brick) const {
    if (visible_before_.empty()) return std::nullopt;
    const BinRange bins = BinsOf(table_, summary_->description, summary_->bricks[NumberIn(summary_->brick_counts, brick)]);
    const int visible = bins.first > bins.last ? 0 : visible_before_[std::size_t(bins.last) + 1] - visible_before_[std::size_t(bins.first)];
    if (visible == 0) return false;
    // Of floats some may not be finite.
    const bool all = visible > bins.last - bins.first && summary_->description.type != ScalarType::kFloat32;
    return all ? std::optional(true) : std::nullopt;
  }

 private:
  const ClassificationTable& table_;
  const VolumeSummary* const summary_;
  std::vector<int> visible_before_;  // [bin]: visible bins before it; empty: nothing is known
};

// The occupied samples of a cell's row, at most kOccupancyCell: bit i is sample i. Rows of one value, most rows of sparse data, take one
// comparison.
template <class T>
std::uint32_t RowMask(const T* row, std::int32_t count, const Occupied<T>& occupied) {
  if (count == kOccupancyCell && std::memcmp(row, row + 1, (kOccupancyCell - 1) * sizeof(T)) == 0) return occupied(row[0]) * 0xFFU;
  std::uint32_t mask = 0;
  for (std::int32_t i = 0; i < count; ++i) mask |= std::uint32_t{occupied(row[i])} << i;
  return mask;
}

template <class T>
CellOccupancy CountCell(const BrickView<T>& brick, const Box& cell, const Occupied<T>& occupied) {
  if (brick.y_stride == 0) return occupied(*brick.first) != 0 ? FullCell(cell) : CellOccupancy{};
  CellOccupancy counted;
  for (std::int32_t z = cell.begin.z; z < cell.end.z; ++z) {
    OccupancyLayer layer = 0;
    for (std::int32_t y = cell.begin.y; y < cell.end.y; ++y) {
      const OccupancyLayer row = RowMask(brick.Row(y, z) + (cell.begin.x - brick.begin.x), cell.size().x, occupied);
      layer |= row << kOccupancyCell * (y - cell.begin.y);
    }
    AddLayer(counted, z - cell.begin.z, layer);
  }
  return counted;
}

template <class T>
void Count(const VoxelBricks& voxels, const ClassificationTable& table, const VolumeSummary* summary, OccupancyGrid& grid) {
  const Occupied<T> occupied(table);
  const KnownBricks known(table, summary);
  const Index3 cells = OccupancyCells(grid.size);
  constexpr std::int32_t kCellsOfBrick = kBrick / kOccupancyCell;
  ParallelFor(0, cells.y * cells.z, [&](std::int32_t row) {
    Index3 cell = {0, row % cells.y, row / cells.y};
    CellOccupancy* out = &grid.cells[std::size_t(row) * std::size_t(cells.x)];
    for (; cell.x < cells.x; ++cell.x) {
      const Index3 brick = {cell.x / kCellsOfBrick, cell.y / kCellsOfBrick, cell.z / kCellsOfBrick};
      const Box box = OccupancyCellBox(cell, grid.size);
      const std::optional<bool> all = known.AllOf(brick);
      if (all) {
        out[cell.x] = *all ? FullCell(box) : CellOccupancy{};
      } else {
        out[cell.x] = CountCell(voxels.View<T>(brick), box, occupied);
      }
    }
  });
}

}  // namespace

OccupancyGrid CountOccupied(const VoxelBricks& voxels, const ClassificationTable& table, const VolumeSummary* summary) {
  const Box& box = voxels.box();
  CHECK(box.begin == Index3{} && !box.empty());
  const Index3 cells = OccupancyCells(box.end);
  OccupancyGrid grid{box.end, std::vector<CellOccupancy>(std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z))};
  VisitScalarType(voxels.type(), [&](auto* type) { Count<std::remove_cvref_t<decltype(*type)>>(voxels, table, summary, grid); });
  return grid;
}

}  // namespace slabstream
