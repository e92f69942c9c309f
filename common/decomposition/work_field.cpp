#include "common/decomposition/work_field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/calibration/calibration.h"
#include "common/volume/indices.h"

namespace slabstream {

std::vector<double> MacrocellWork(const OccupancyGrid& grid) {
  std::vector<double> work;
  work.reserve(grid.cells.size());
  for (const CellOccupancy& cell : grid.cells) work.push_back(cell.voxels > 0 ? cell.voxels + calibration::kMacrocellWork : 0);
  return work;
}

WorkField WorkField::Uniform(const Index3& size) { return WorkField(size); }

WorkField::WorkField(const Index3& size, std::span<const double> work) : size_(size) {
  const double total = std::accumulate(work.begin(), work.end(), 0.0);
  CHECK(std::isfinite(total) && total >= 0) << total;
  if (total > 0) step_ = total * 0x1p-40;
  std::vector<double> steps;
  steps.reserve(work.size());
  for (const double w : work) steps.push_back(w > 0 ? std::max(1.0, std::round(w / step_)) : 0);
  SumUp(steps);
}

void WorkField::SumUp(std::span<const double> steps) {
  const Index3 cells = OccupancyCells(size_);
  corners_ = {cells.x + 1, cells.y + 1, cells.z + 1};
  CHECK_EQ(steps.size(), std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z));
  const std::size_t row = std::size_t(corners_.x), slice = row * std::size_t(corners_.y);
  sums_.assign(slice * std::size_t(corners_.z), 0);
  const double* step = steps.data();
  for (std::size_t z = 1; z < std::size_t(corners_.z); ++z) {
    for (std::size_t y = 1; y < std::size_t(corners_.y); ++y) {
      double in_row = 0;
      for (std::size_t at = z * slice + y * row + 1; at < z * slice + (y + 1) * row; ++at) {
        in_row += *step++;
        sums_[at] = in_row + sums_[at - row] + sums_[at - slice] - sums_[at - slice - row];
      }
    }
  }
}

double WorkField::Before(const Index3& corner) const {
  // Between corners of cells, trilinearly: work is even within a cell.
  Index3 low;
  Vec3 share;
  for (const Axis axis : kAxes) {
    low[axis] = corner[axis] / kOccupancyCell;
    const std::int32_t width = std::min(size_[axis] - low[axis] * kOccupancyCell, kOccupancyCell);
    share[axis] = width > 0 ? double(corner[axis] % kOccupancyCell) / width : 0;
  }
  const auto along_x = [&](std::int32_t y, std::int32_t z) {
    const double* row = &sums_[NumberIn(corners_, {0, y, z})];
    return share.x == 0 ? row[low.x] : row[low.x] + share.x * (row[low.x + 1] - row[low.x]);
  };
  const auto along_y = [&](std::int32_t z) {
    const double a = along_x(low.y, z);
    return share.y == 0 ? a : a + share.y * (along_x(low.y + 1, z) - a);
  };
  const double a = along_y(low.z);
  return share.z == 0 ? a : a + share.z * (along_y(low.z + 1) - a);
}

double WorkField::Sum(const Box& box) const {
  const Box part = Intersection(box, {{0, 0, 0}, size_});
  if (part.empty()) return 0;
  if (uniform()) return double(part.voxel_count());
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](Axis axis) { return (corner >> Number(axis) & 1) != 0 ? part.end[axis] : part.begin[axis]; };
    const int begins = 3 - std::popcount(unsigned(corner));
    sum += (begins % 2 == 0 ? 1 : -1) * Before({at(Axis::kX), at(Axis::kY), at(Axis::kZ)});
  }
  return std::max(sum, 0.0) * step_;
}

double WorkField::StepsOf(const Box& cells) const {
  const auto& [begin, end] = cells;
  const auto at = [&](std::int32_t x, std::int32_t y, std::int32_t z) { return sums_[NumberIn(corners_, {x, y, z})]; };
  return at(end.x, end.y, end.z) - at(begin.x, end.y, end.z) - at(end.x, begin.y, end.z) - at(end.x, end.y, begin.z) +
         at(begin.x, begin.y, end.z) + at(begin.x, end.y, begin.z) + at(end.x, begin.y, begin.z) - at(begin.x, begin.y, begin.z);
}

Box WorkField::Hull(const Box& box) const {
  const Box part = Intersection(box, {{0, 0, 0}, size_});
  if (part.empty() || uniform()) return part;
  Box cells = CubesTouched(part, kOccupancyCell);
  if (StepsOf(cells) == 0) return {};
  for (const Axis axis : kAxes) {
    const auto empty = [&](std::int32_t first, std::int32_t last) {
      Box slices = cells;
      slices.begin[axis] = first;
      slices.end[axis] = last;
      return StepsOf(slices) == 0;
    };
    while (empty(cells.begin[axis], cells.begin[axis] + 1)) ++cells.begin[axis];
    while (empty(cells.end[axis] - 1, cells.end[axis])) --cells.end[axis];
  }
  return Intersection({kOccupancyCell * cells.begin, kOccupancyCell * cells.end}, part);
}

std::int32_t PlaneAt(const WorkField& work, const Box& box, Axis axis, std::int64_t part, std::int64_t whole) {
  const std::int32_t begin = box.begin[axis], end = box.end[axis];
  CHECK_GE(end - begin, 2);
  const double total = work.Sum(box);
  const auto inside = [&](std::int64_t position) { return std::int32_t(std::clamp<std::int64_t>(position, begin + 1, end - 1)); };
  if (work.uniform() || total <= 0) return inside(begin + part * (end - begin) / whole);

  const double wanted = total * double(part) / double(whole);
  const auto below = [&](std::int32_t position) {
    Box lower = box;
    lower.end[axis] = position;
    return work.Sum(lower);
  };
  std::int32_t low = begin, high = end;  // below(low) < wanted <= below(high)
  while (high - low > 1) {
    const std::int32_t middle = low + (high - low) / 2;
    (below(middle) < wanted ? low : high) = middle;
  }
  return inside(wanted - below(low) < below(high) - wanted ? low : high);
}

}  // namespace slabstream
