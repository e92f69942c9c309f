// The lattice under an unstructured grid: a volume of float32 voxels that fills the grid's bounding box. Boxes, partitions and empty space
// of the grid are counted in its voxels, and renderers of volumes draw it; the cells themselves are drawn by slicing.
//
// All functions may be called from any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

class CellRuns;

inline constexpr std::int32_t kMaxLatticeSide = 1024;  // voxels

// Extents of a grid along each axis: its places, measured from a corner, keep their precision as floats.
inline constexpr double kLeastExtent = 1e-30, kMostExtent = 1e30;

// In the world.
struct Bounds3 {
  Vec3 low, high;
};

// A lattice whose volume is `bounds` exactly: the outer voxels' centres lie half a voxel inside its sides. Voxels are nearly cubes.
// `longest_side`: voxels along the longest side, in [1, kMaxLatticeSide]; none: such that there are two voxels for each of `cells`, but at
// least 32 and at most 256 along the longest side. The axes are those of the world. Expects extents in [kLeastExtent, kMostExtent].
VolumeGeometry LatticeOf(const Bounds3& bounds, std::int64_t cells, std::optional<std::int32_t> longest_side);

// Moves points from the world, measured from bounds.low, to data space of the lattice: [-0.5, size - 0.5] along each axis.
void MoveToLattice(const VolumeGeometry& lattice, Mesh& mesh);

// Where along the curve by which SortByPlace sorts each tetrahedron lies; those with the same place keep their order. Parallel.
std::vector<std::uint32_t> PlacesOf(const Mesh& mesh, const VolumeGeometry& lattice);

// Orders tetrahedra and points so that what is near in space is near in memory. Points of no tetrahedron are dropped. Parallel, with the
// same result for any number of threads.
void SortByPlace(const VolumeGeometry& lattice, Mesh& mesh);

// The grid's value at each voxel's centre; NaN where there is no cell, or one with a value that is not finite. Cells contain what lies on
// their faces; of several cells that contain a centre it is the one with the highest number that counts. Flat cells contain nothing.
// Parallel, with the same result for any number of threads.
Volume Resample(const Mesh& mesh, const VolumeGeometry& lattice);

// The same of a grid whose cells are given part by part: the empty lattice, then the cells of each part in the order of the whole grid.
// `runs`: of `mesh`.
Volume EmptyLattice(const VolumeGeometry& lattice);
void FillLattice(const Mesh& mesh, const CellRuns& runs, Volume& volume);

}  // namespace slabstream
