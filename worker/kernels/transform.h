// The transform stage: from voxels to footprint positions, by increments (Yagel and Machiraju, section 3.3).
//
// The paper transforms one seed voxel by a matrix product and reaches all others by additions: along a beam (voxel phase), from beam to
// beam and from slice to slice. Its rounding errors grow with the number of additions before a voxel, and they depend on where the walk
// began. Here each phase multiplies its increment by the number of steps instead (one multiplication and addition a coordinate), slices and
// beams in double precision, voxels in float relative to a seed at the latest global multiple of kFootprintCell voxels and to a whole pixel
// near it. So the error does not grow with N, and a voxel's coordinates are the same in every partition.
//
// Error bound against a matrix product in double precision: |t - t_exact| <= 2^-21 * kFootprintCell * s pixels, s the size of a voxel in
// pixels, for any volume size: 1.5e-5 pixels at one pixel a voxel. (Three roundings of values up to kFootprintCell * s, four under
// perspective, w within a factor of 2.) Instruction sets agree bit for bit: multiplications and additions are not fused.
#pragma once

#include "worker/kernels/voxel_batch.h"

namespace slabstream {

// Fills column, row, phase_x, phase_y, record and (perspective only) area of `batch` from its pieces.
void TransformPieces(Projection projection, VoxelBatch& batch);
void TransformPiecesReference(Projection projection, VoxelBatch& batch);

}  // namespace slabstream
