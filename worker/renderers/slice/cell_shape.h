// CellShape: a tetrahedron in frame space, as functions that are linear there. On a row of a plane it is the interval between faces.
//
// A face lies at x = at + s * per_s + y * per_y. The two cells that share it compute the same bits, since they take its points in the same
// order. One cell has the whole numbers x >= root, the other one those below: so every sample inside a grid lies in one cell.
#pragma once

namespace slabstream::slice {

// The function at + s * per_s + y * per_y + x * per_x.
struct LinearFunction {
  double at, per_s, per_y, per_x;
};

struct CellShape {
  // Faces. Face 0 lies before the cell (x >= root), face 3 behind it, and the others as the numbers say that are added to their roots: 0 or
  // an infinity.
  double at[4], per_s[4], per_y[4];
  double before[2], behind[2];  // what is added to the roots of faces 1 and 2
  LinearFunction value;         // divided by FrameSpace::ScaleOf(k)
  float least, greatest;        // the range of the cell's values
  LinearFunction slope[3];      // the gradient's components, of any scale that they share; of cells that are lit
};

}  // namespace slabstream::slice
