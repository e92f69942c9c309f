#include "worker/rays/stretch_tables.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <vector>

namespace slabstream {
namespace {

// For each step between knots: the least of it and its neighbours.
std::vector<double> Strides(const std::vector<double>& knots) {
  std::vector<double> strides;
  const std::size_t last = knots.size() - 1;
  for (std::size_t i = 0; i < last; ++i) {
    double least = knots[i + 1] - knots[i];
    if (i > 0) least = std::min(least, knots[i] - knots[i - 1]);
    if (i + 1 < last) least = std::min(least, knots[i + 2] - knots[i + 1]);
    strides.push_back(least);
  }
  return strides;
}

StretchTable TableOf(const std::vector<double>& knots, double& longest) {
  constexpr double kMostBins = 65536;
  constexpr double kRounding = 0.05;  // of a bin: more than single precision may move
  StretchTable table;
  if (knots.empty()) return table;
  table.knots.assign(knots.begin(), knots.end());
  double least = 1;
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    table.per_step.push_back(float(1 / (knots[i + 1] - knots[i])));
    least = std::min(least, knots[i + 1] - knots[i]);
  }
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const std::size_t before = std::max(i, std::size_t{1}) - 1, behind = std::min(i + 1, knots.size() - 1);
    table.slopes.push_back(float(double(behind - before) / (knots[behind] - knots[before])));
  }
  const std::vector<double> strides = Strides(knots);
  longest = *std::ranges::max_element(strides);
  const double size = double(knots.size()) - 2, bins = std::min(std::ceil(size / least), std::max(kMostBins, size));
  table.bins_a_unit = float(bins / size);
  std::size_t knot = 0, most = 1;  // knots within a bin
  for (double bin = 0; bin < bins; ++bin) {
    const double begin = (bin - kRounding) / double(table.bins_a_unit) - 0.5, end = (bin + 1 + kRounding) / double(table.bins_a_unit) - 0.5;
    while (knot + 2 < knots.size() && knots[knot + 1] <= begin) ++knot;
    table.first.push_back(std::int32_t(knot));
    double stride = strides[knot];
    std::size_t i = knot + 1;
    for (; i < strides.size() && knots[i] < end; ++i) stride = std::min(stride, strides[i]);
    table.strides.push_back(float(stride));
    most = std::max(most, i - 1 - knot);
  }
  table.first_step = std::int32_t(std::bit_floor(most));
  return table;
}

}  // namespace

StretchTables::StretchTables(const Stretch& stretch) {
  double side = 1;
  for (const Axis axis : kAxes) {
    const std::vector<double>& knots = stretch.knots(axis);
    axes[std::size_t(Number(axis))] = TableOf(knots, longest[axis]);
    if (!knots.empty()) side = std::max(side, double(knots.size()));
  }
  margin = float(0x1p-20 * side);
}

}  // namespace slabstream
