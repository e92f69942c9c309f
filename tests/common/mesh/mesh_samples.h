// Meshes for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "common/math/vec.h"
#include "common/mesh/mesh.h"
#include "common/volume/volume.h"
#include "tests/support/random.h"

namespace slabstream {

// Fills the volume of a lattice of `size` voxels, [-0.5, size - 0.5] along each axis, in data space. It consists of hexahedra,
// `cells_per_side` along each axis, some of which are voxels, pairs of wedges or six pyramids; all are split by SplitCell. Inner points are
// moved at random by up to `jitter` of a hexahedron's side along each axis: below about 0.2 no tetrahedron turns over. The values belong to
// points: value(place).
Mesh MakeTetrahedralCube(const Index3& size, int cells_per_side, Random& random, double jitter,
                         const std::function<double(const Vec3&)>& value);

// The same mesh with values at its cells: value(cell).
Mesh WithCellValues(Mesh mesh, const std::function<double(std::size_t)>& value);

// A grid of hexahedra, each split into tetrahedra, that fills the volume. It has points at the centres of every `step`-th voxel along each
// axis, with the voxel's stored sample as value, and on the volume's sides, with the samples nearest to them.
Mesh GridOf(const Volume& volume, std::int32_t step);

// The volume of such a grid as readers make it: the cells, and their values at the voxels of the same lattice.
Volume AsGrid(const Volume& volume, std::int32_t step = 2);

Vec3 PlaceOfPoint(const Mesh& mesh, PointNumber point);

}  // namespace slabstream
