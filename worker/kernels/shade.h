// The shading stage of splatting: what each voxel of a batch adds to its sheet, by two look-ups.
#pragma once

#include <vector>

#include "common/base/aligned_buffer.h"
#include "worker/kernels/phong.h"
#include "worker/kernels/voxel_batch.h"

namespace slabstream {

// Made once a frame.
struct ShadeTables {
  AlignedVector<float> color;           // [bin][4]: straight colour, then 1
  AlignedVector<float> opacity;         // [bin]: of one sheet (orthographic: times the area of a voxel's cell of the slice)
  std::vector<PhongFactors> by_normal;  // by normal code
};

// Fills batch.rgba: opacity * (shaded colour, 1), times batch.area if `per_voxel_area`.
void ShadePieces(const ShadeTables& tables, bool per_voxel_area, VoxelBatch& batch);
void ShadePiecesReference(const ShadeTables& tables, bool per_voxel_area, VoxelBatch& batch);

}  // namespace slabstream
