// The splat stage: adds the footprints of a batch to a sheet (Westover 1990: one sheet a slice).
#pragma once

#include <cstdint>

#include "worker/kernels/voxel_batch.h"

namespace slabstream {

// Interleaved RGBA, rows of `width` pixels without padding. Not owned.
struct SheetView {
  float* rgba = nullptr;
  std::int32_t width = 0, height = 0;
};

// sheet(pixel) += wx(pixel) * wy(pixel) * rgba for every voxel and every pixel of its footprint inside the sheet. Sums are in the order of
// voxels; kernels for different instruction sets differ in the rounding of each addition only.
void SplatPieces(const VoxelBatch& batch, const SheetView& sheet);
void SplatPiecesReference(const VoxelBatch& batch, const SheetView& sheet);

// One piece, whose voxels begin at `first` in the batch: also what SplatPieces does with kernels too wide for tables.
void SplatPieceReference(const VoxelBatch& batch, const BeamPiece& piece, std::size_t first, const SheetView& sheet);

}  // namespace slabstream
