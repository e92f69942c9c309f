// Finds the cells of a mesh that touch a box without a look at each: runs of consecutive tetrahedra have bounding boxes of their own. It
// pays if the mesh is sorted (SortByPlace, lattice.h).
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "common/mesh/mesh_cell.h"

namespace slabstream {

class CellRuns {
 public:
  static constexpr std::size_t kCells = 256;  // of a run

  explicit CellRuns(const Mesh& mesh);  // parallel

  // What the cells of each run lie in.
  std::span<const CellBounds> bounds() const { return runs_; }

  // Calls function(cell, its bounds) for the cells of the mesh whose bounds touch `space`, by ascending number. The mesh is the one that
  // the runs were made of.
  template <class Function>
  void Visit(const Mesh& mesh, const CellBounds& space, Function&& function) const {
    for (std::size_t run = 0; run < runs_.size(); ++run) {
      if (!Touch(runs_[run], space)) continue;
      const std::size_t end = std::min((run + 1) * kCells, mesh.tetrahedra.size());
      for (std::size_t cell = run * kCells; cell < end; ++cell) {
        if (const CellBounds bounds = BoundsOf(mesh, cell); Touch(bounds, space)) function(cell, bounds);
      }
    }
  }

  std::size_t bytes() const { return runs_.capacity() * sizeof(runs_[0]); }

 private:
  std::vector<CellBounds> runs_;
};

}  // namespace slabstream
