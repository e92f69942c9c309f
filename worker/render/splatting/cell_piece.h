// CellPiece: what all voxels of one cell of a beam share. Here coordinates pass from double precision, of the whole picture, to single
// precision, relative to a whole pixel near the cell.
#pragma once

#include "worker/kernels/voxel_batch.h"
#include "worker/render/splatting/footprints.h"
#include "worker/render/splatting/slice_projection.h"

namespace slabstream {

// `first`: the cell's first place along u, a global multiple of kFootprintCell; `step`: from voxel to voxel. Columns and rows are those of
// the frame. Mask, count, records and area are left to the caller.
BeamPiece CellPiece(const Homogeneous& first, const Homogeneous& step, const FootprintPair& footprint);

}  // namespace slabstream
