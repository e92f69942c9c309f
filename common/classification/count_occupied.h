// Counting occupied voxels: one pass over a volume, or over the cells of a grid.
#pragma once

#include "common/classification/classification_table.h"
#include "common/mesh/mesh_part.h"
#include "common/volume/bricks.h"
#include "common/volume/occupancy_grid.h"

namespace slabstream {

// Occupied: the voxel's bin has an opacity above zero, as the renderers see it; samples that are not finite never are. `voxels` are those
// of a whole volume, from voxel 0 on. Parallel, with the same result for any number of threads; bricks of one value cost next to nothing,
// and so do those of which the volume's summary tells that all or none of their voxels are occupied. Null: nothing is known of them.
OccupancyGrid CountOccupied(const VoxelBricks& voxels, const ClassificationTable& table, const VolumeSummary* summary = nullptr);

// Counts the voxels of an unstructured grid's lattice. A voxel is occupied if the space that it fills touches the
// bounding box of a cell that may be visible, because an opacity between the cell's least and greatest value is above
// zero. A cell with a value that is not finite is invisible. Parallel, with the same result for any number of threads.
OccupancyGrid CountOccupiedByCells(const Mesh& mesh, const VolumeDescription& lattice, const ClassificationTable& table);
Result<OccupancyGrid> CountOccupiedByCells(const GridCells& cells, const VolumeDescription& lattice, const ClassificationTable& table);

}  // namespace slabstream
