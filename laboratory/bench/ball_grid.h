// A test object for unstructured grids: a ball in a cube of tetrahedra. Deterministic.
//
// The cube is a lattice of `size` voxels a side, divided into `cells` hexahedra a side, each split into tetrahedra (cells.h). Inner points
// are moved by up to a tenth of a hexahedron's side along each axis, so that nothing is regular. The value at a point falls linearly from
// 255 in the middle to 0 at a distance of 0.45 sides, and is 0 beyond.
#pragma once

#include "common/base/status.h"
#include "common/volume/volume.h"

namespace slabstream {

struct GridRequest {
  int size = 128;  // the lattice's side in voxels, [8, 1024]
  int cells = 32;  // hexahedra a side, [2, 256]
};

// The lattice with the values of the grid, and the grid (Volume::cells). InvalidArgument naming the field, the value and the limits.
Result<Volume> MakeBallGrid(const GridRequest& request);

}  // namespace slabstream
