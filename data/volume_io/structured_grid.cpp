#include "data/volume_io/structured_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabstream {

Status SetGrid(RawHeader& header, const std::string& path, const PointGrid& grid, ValuesAt at) {
  std::vector<double> sizes(grid.points.begin(), grid.points.end());
  header.origin = grid.origin;
  if (at == ValuesAt::kCells) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (grid.points[axis] == 1) continue;
      sizes[axis] -= 1;
      header.origin = header.origin + 0.5 * grid.steps[axis];
    }
  }
  header.world = World::kScene;
  header.matrix = grid.matrix;
  header.steps = grid.steps;
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    if (grid.uneven[i].empty()) continue;
    Result<UnevenAxis> uneven = UnevenAxisOf(fmt::format("{}: its coordinates along {}", path, Letter(axis)), grid.uneven[i], at);
    if (!uneven.ok()) return uneven.status();
    const std::vector<double>& centres = uneven->centres;
    header.origin[axis] = centres.front();
    header.steps[i][axis] = (centres.back() - centres.front()) / double(centres.size() - 1);
    header.uneven[i] = *std::move(uneven);
  }
  return SetSize(header, path, std::move(sizes), {});
}

PointGrid GridOfCoordinates(const std::array<std::vector<double>, 3>& coordinates) {
  PointGrid grid{.matrix = "coordinates"};
  Vec3 steps;
  double smallest = std::numeric_limits<double>::infinity();
  for (const Axis axis : kAxes) {
    const std::vector<double>& places = coordinates[std::size_t(Number(axis))];
    const double first = places.front(), step = places.size() > 1 ? (places.back() - first) / double(places.size() - 1) : 0;
    const double rounding = double{std::numeric_limits<float>::epsilon()} * std::max(std::abs(first), std::abs(places.back()));
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double even = first + double(i) * step;
      if (std::abs(places[i] - even) <= kMostUneven * std::abs(step) + rounding && (step != 0 || places.size() == 1)) continue;
      grid.uneven[std::size_t(Number(axis))] = places;
      break;
    }
    grid.points[std::size_t(Number(axis))] = double(places.size());
    grid.origin[axis] = first;
    steps[axis] = step;
    if (step != 0) smallest = std::min(smallest, std::abs(step));
  }
  for (const Axis axis : kAxes) {
    if (steps[axis] == 0) steps[axis] = std::isfinite(smallest) ? smallest : 1;
  }
  grid.steps = StepsOf(steps);
  return grid;
}

}  // namespace slabstream
