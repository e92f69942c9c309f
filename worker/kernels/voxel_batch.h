// What the splatting stages hand to each other: transform, shade and splat each run over a batch of some hundred voxels that stays in the
// first-level cache.
//
// The unit of work is a BeamPiece: the occupied voxels of one beam (u varies; v and the slice are fixed) within one lattice cell,
// kFootprintCell voxels of the volume along u from a global multiple on. All that its voxels share is computed once, in double precision,
// from the lattice place alone, so nothing about a voxel depends on how the volume is divided.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_buffer.h"
#include "common/view/camera.h"
#include "worker/kernels/gaussian_kernel.h"

namespace slabstream {

// What is kept of an occupied voxel from frame to frame.
struct VoxelRecord {
  std::uint16_t bin = 0;     // of the classification table
  std::uint16_t normal = 0;  // normal_code.h
};

struct BeamPiece {
  std::uint32_t mask = 0;                // bit i: voxel i of the cell is occupied (and in this piece); not 0
  std::int32_t count = 0;                // bits of mask; after culling, how many of these voxels are left in the batch
  const VoxelRecord* records = nullptr;  // of the voxels of `mask`, in order
  const GaussianKernel* kernel_x = nullptr;
  const GaussianKernel* kernel_y = nullptr;
  // Homogeneous coordinates of voxel i, relative to the pixel (column, row): (x0 + i * x_step, y0 + i * y_step, w0 + i * w_step). Divided
  // by w they give t of gaussian_kernel.h less (column - 1) or (row - 1). Orthographic: w is 1 and not read.
  float x0 = 0, x_step = 0;
  float y0 = 0, y_step = 0;
  float w0 = 1, w_step = 0;
  float area = 1;                    // of the voxel's cell of the slice in pixels^2, times w^3 (voxel by voxel: area / w^3)
  std::int32_t column = 0, row = 0;  // of the sheet
};

// Voxels of all pieces in order, one array a component. Arrays have kBatchSlack elements more than voxels fit, so that vectors may write
// past the end. A piece's mask and records are read by the transform; all later stages go by its count.
struct VoxelBatch {
  static constexpr std::size_t kVoxels = 1024;
  static constexpr std::size_t kBatchSlack = 64;

  VoxelBatch() {
    for (auto* ints : {&column, &row, &phase_x, &phase_y}) ints->resize(kVoxels + kBatchSlack);
    record.resize(kVoxels + kBatchSlack);
    area.resize(kVoxels + kBatchSlack);
    rgba.resize(4 * (kVoxels + kBatchSlack));
  }

  std::vector<BeamPiece> pieces;
  std::size_t voxel_count = 0;  // in all pieces; at most kVoxels

  // Written by the transform.
  AlignedVector<std::int32_t> column, row;       // of the sheet: first tap of the footprint
  AlignedVector<std::int32_t> phase_x, phase_y;  // sub-pixel phase
  AlignedVector<float> area;                     // pixels^2 of the voxel's cell of the slice (perspective only)
  AlignedVector<VoxelRecord> record;
  // Written by shading: premultiplied colour and opacity times area, 4 floats a voxel.
  AlignedVector<float> rgba;
};

}  // namespace slabstream
