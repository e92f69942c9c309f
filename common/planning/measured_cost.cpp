#include "common/planning/measured_cost.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/volume/cells_along.h"

namespace slabstream {
namespace {

// Calls function(cell number, share of the cell that lies in `box`).
template <class Function>
void ForEachCell(const Index3& size, const Box& box, Function&& function) {
  const Index3 cells = OccupancyCells(size);
  const CellsAlong xs(box, Axis::kX), ys(box, Axis::kY), zs(box, Axis::kZ);
  std::vector<double> shares_x;
  for (std::int32_t x = xs.begin; x < xs.end; ++x) shares_x.push_back(CellShare(box, Axis::kX, x, size));
  for (std::int32_t z = zs.begin; z < zs.end; ++z) {
    const double share_z = CellShare(box, Axis::kZ, z, size);
    for (std::int32_t y = ys.begin; y < ys.end; ++y) {
      const double share_yz = share_z * CellShare(box, Axis::kY, y, size);
      std::size_t cell = NumberIn(cells, {xs.begin, y, z});
      for (const double share_x : shares_x) function(cell++, share_x * share_yz);
    }
  }
}

}  // namespace

MeasuredCost::MeasuredCost(const OccupancyGrid& grid) : size_(grid.size), cost_(MacrocellWork(grid)) {}

void MeasuredCost::Learn(std::span<const BoxSeconds> boxes, double weight) {
  CHECK(weight > 0 && weight <= 1) << weight;
  const auto predicted = [this](const Box& box) {
    double sum = 0;
    ForEachCell(size_, box, [&](std::size_t cell, double share) { sum += share * cost_[cell]; });
    return sum;
  };
  if (!any_) {
    // From units of work to seconds.
    double seconds = 0, work = 0;
    for (const BoxSeconds& box : boxes) {
      seconds += box.seconds;
      work += predicted(box.box);
    }
    if (!(seconds > 0 && work > 0)) return;
    for (double& cost : cost_) cost *= seconds / work;
    any_ = true;
  }
  for (const BoxSeconds& box : boxes) {
    const double expected = predicted(box.box);
    if (!(expected > 0)) continue;  // all it has is beside it
    const double excess = weight * (std::clamp(box.seconds / expected, kLeastFactor, kMostFactor) - 1);
    ForEachCell(size_, box.box, [&](std::size_t cell, double share) { cost_[cell] *= 1 + share * excess; });
  }
}

WorkField MeasuredCost::Field() const { return {size_, cost_}; }

}  // namespace slabstream
