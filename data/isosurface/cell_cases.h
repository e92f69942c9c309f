// CellCases: the triangles of a cell of marching cubes (Lorensen and Cline, 1987), for each choice of its corners that lie inside.
//
// The table is derived, not copied. On each face of the cell, each run of corners inside is cut off by a segment (Wyvill, McPheeters and
// Wyvill, 1986): two corners inside that lie opposite each other stay apart. This looks at the face alone, so both cells at a face have the
// same segments there, and no hole opens. The segments form loops, which are cut into triangles. No cut lies in a face of the cell: the
// neighbour could have the same cut, and four triangles would meet in it.
//
// Corner x, y, z in {0, 1} has the number y + 2 z + 4 x. Edges along x have the numbers y + 2 z, along y 4 + x + 2 z, along z 8 + x + 2 y.
#pragma once

#include <array>
#include <cstdint>

namespace slabstream {

struct CellCase {
  std::uint8_t count = 0;                                  // triangles
  std::array<std::array<std::uint8_t, 3>, 5> triangles{};  // edges; counterclockwise for who looks from outside
};

// By the set of the corners inside: bit k is corner k.
const std::array<CellCase, 256>& CellCases();

}  // namespace slabstream
