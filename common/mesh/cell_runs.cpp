#include "common/mesh/cell_runs.h"

#include "common/parallel/parallel.h"

namespace slabstream {

CellRuns::CellRuns(const Mesh& mesh) : runs_((mesh.tetrahedra.size() + kCells - 1) / kCells) {
  ParallelFor(0, runs_.size(), [&](std::size_t run) {
    CellBounds& hull = runs_[run];
    hull = BoundsOf(mesh, run * kCells);
    for (std::size_t cell = run * kCells; cell < std::min((run + 1) * kCells, mesh.tetrahedra.size()); ++cell) {
      const CellBounds bounds = BoundsOf(mesh, cell);
      for (int axis = 0; axis < 3; ++axis) {
        hull.low[axis] = std::min(hull.low[axis], bounds.low[axis]);
        hull.high[axis] = std::max(hull.high[axis], bounds.high[axis]);
      }
    }
  });
}

}  // namespace slabstream
