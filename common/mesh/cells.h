// Cells of an unstructured grid, and how they are split into tetrahedra.
//
// A cell is split by pulling its point of the lowest number (De Loera, Rambau, Santos 2010, "Triangulations", section 4.3.2): each face of
// the cell that does not have this point is cut into triangles, and each triangle makes a tetrahedron with the point. A face with four
// points is cut from its own lowest one. So two cells of any kinds split their common face in the same way, and the tetrahedra of a
// grid fit together without gaps.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace slabstream {

using PointNumber = std::uint32_t;
using Tetrahedron = std::array<PointNumber, 4>;

// The order of a cell's points, and of those of its faces, is VTK's (Schroeder, Martin, Lorensen, "The Visualization Toolkit", figure
// "Linear cell types").
struct CellKind {
  std::string_view name;  // "hexahedron"
  int vtk_type = 0;
  int points = 0;
  std::vector<std::vector<std::uint8_t>> faces;  // places of points in the cell, around the face; none: the cell has no volume
  bool has_volume() const { return !faces.empty(); }
};

// Those that have straight edges and a fixed number of points.
const std::vector<CellKind>& CellKinds();
// Null: no such kind.
const CellKind* FindCellKind(int vtk_type);

// Appends the tetrahedra of a cell with these points, kind.points of them.
void SplitCell(const CellKind& kind, std::span<const PointNumber> points, std::vector<Tetrahedron>& out);

}  // namespace slabstream
