#include "common/mesh/cells.h"

#include <algorithm>

namespace slabstream {

const std::vector<CellKind>& CellKinds() {
  static const std::vector<CellKind> kinds = {
      {"vertex", 1, 1, {}},
      {"line", 3, 2, {}},
      {"triangle", 5, 3, {}},
      {"pixel", 8, 4, {}},
      {"quadrilateral", 9, 4, {}},
      {"tetrahedron", 10, 4, {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 3}}},
      {"voxel", 11, 8, {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}},
      {"hexahedron", 12, 8, {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 3, 7, 4}}},
      {"wedge", 13, 6, {{0, 1, 2}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {0, 2, 5, 3}}},
      {"pyramid", 14, 5, {{0, 1, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {0, 3, 4}}},
  };
  return kinds;
}

const CellKind* FindCellKind(int vtk_type) {
  const auto found = std::ranges::find(CellKinds(), vtk_type, &CellKind::vtk_type);
  return found == CellKinds().end() ? nullptr : &*found;
}

void SplitCell(const CellKind& kind, std::span<const PointNumber> points, std::vector<Tetrahedron>& out) {
  if (!kind.has_volume()) return;
  const PointNumber apex = *std::ranges::min_element(points);
  for (const std::vector<std::uint8_t>& face : kind.faces) {
    const auto at = [&](std::size_t n) { return points[face[n % face.size()]]; };
    std::size_t lowest = 0;
    bool has_apex = false;
    for (std::size_t n = 0; n < face.size(); ++n) {
      has_apex |= at(n) == apex;
      if (at(n) < at(lowest)) lowest = n;
    }
    if (has_apex) continue;
    for (std::size_t n = 1; n + 1 < face.size(); ++n) out.push_back({apex, at(lowest), at(lowest + n), at(lowest + n + 1)});
  }
}

}  // namespace slabstream
