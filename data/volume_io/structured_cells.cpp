#include "data/volume_io/structured_cells.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/volume/memory_budget.h"

namespace slabstream {

bool HasVolume(const GridPoints& points) { return std::ranges::min(points) > 1; }

std::string ToText(const GridPoints& points) { return fmt::format("{} x {} x {} points", points[0], points[1], points[2]); }

Status CheckPointCount(const std::string& where, const GridPoints& points) {
  // Their product may not fit an integer.
  if (double(points[0]) * double(points[1]) * double(points[2]) <= double(kMaxMeshPoints)) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{}: has {}, must have at most {} in all", where, ToText(points), kMaxMeshPoints));
}

Status AddStructuredCells(const GridPoints& points, MeshBuilder& builder) {
  constexpr int kHexahedron = 12;  // VTK's
  const auto [x, y, z] = points;
  const std::int64_t in_layer = (x - 1) * (y - 1);
  if (Status status = builder.Reserve(*FindCellKind(kHexahedron), in_layer * (z - 1)); !status.ok()) return status;
  constexpr std::int64_t kBytesPerCell = 9 * sizeof(std::int64_t);
  if (Status status = CheckFitsMemory(in_layer * kBytesPerCell, "a layer of a grid's cells"); !status.ok()) return status;
  const WholeNumbers kinds(std::size_t(in_layer), kHexahedron);
  WholeNumbers corners;
  for (std::int64_t k = 0; k + 1 < z; ++k) {
    corners.clear();
    for (std::int64_t j = 0; j + 1 < y; ++j) {
      for (std::int64_t i = 0; i + 1 < x; ++i) {
        for (const std::int64_t layer : {k, k + 1}) {
          const std::int64_t near = (layer * y + j) * x + i, far = near + x;
          for (const std::int64_t corner : {near, near + 1, far + 1, far}) corners.push_back(corner);
        }
      }
    }
    if (Status status = builder.AddCells(kinds, corners); !status.ok()) return status;
  }
  return Status::Ok();
}

}  // namespace slabstream
