// CellShape: a tetrahedron in frame space, as functions that are linear there. On a row of a plane it is the interval between faces.
//
// A face lies at x = at + s * per_s + y * per_y. The two cells that share it compute the same bits, since they take its points in the same
// order. One cell has the whole numbers x >= root, the other one those below: so every sample inside a grid lies in one cell.
#pragma once

namespace slabstream::slice {

struct CellShape {
  // Faces. Face 0 lies before the cell (x >= root), face 3 behind it, and the others as the numbers say that are added to their roots: 0 or
  // an infinity.
  double at[4], per_s[4], per_y[4];
  double before[2], behind[2];  // of faces 1 and 2
  // The value, divided by FrameSpace::ScaleOf(k): value + s * value_s + y * value_y + x * value_x.
  double value, value_s, value_y, value_x;
  float least, greatest;  // of the cell's values
};

}  // namespace slabstream::slice
