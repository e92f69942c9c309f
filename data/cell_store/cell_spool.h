// CellSpool: the tetrahedra of a grid that does not fit the memory, in files, as its reader (data/volume_io/mesh_builder.h) finds them.
#pragma once

#include <array>
#include <string>

#include "common/mesh/cells.h"
#include "data/cell_store/record_file.h"

namespace slabstream {

// x, y and z in the world, finite, and the value; 0 where values belong to cells.
using MeshPoint = std::array<double, 4>;

struct CellSpool {
  // In a folder, for this user alone.
  static Result<CellSpool> Create(const std::string& folder) {
    auto points = Records<MeshPoint>::Create(folder + "/spool-points");
    auto cells = Records<Tetrahedron>::Create(folder + "/spool-cells");
    auto values = Records<float>::Create(folder + "/spool-values");
    if (!points.ok()) return points.status();
    if (!cells.ok()) return cells.status();
    if (!values.ok()) return values.status();
    return CellSpool{folder, *std::move(points), *std::move(cells), *std::move(values)};
  }

  std::string folder;
  Records<MeshPoint> points;
  Records<Tetrahedron> cells;  // numbers of `points`
  Records<float> values;       // of the cells, if values belong to them
};

}  // namespace slabstream
