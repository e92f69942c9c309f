#include "worker/kernels/cull.h"

#include <algorithm>

#include "worker/kernels/composite.h"

namespace slabstream {

void CullHiddenVoxels(const HiddenTiles& tiles, VoxelBatch& batch) {
  std::int32_t *const columns = batch.column.data(), *const rows = batch.row.data();
  std::int32_t *const phases_x = batch.phase_x.data(), *const phases_y = batch.phase_y.data();
  VoxelRecord* const records = batch.record.data();
  float* const areas = batch.area.data();
  const std::int32_t last_x = tiles.tiles_x * kTile - 1, last_y = tiles.tiles_y * kTile - 1;  // pixels
  std::size_t kept = 0, n = 0;
  for (BeamPiece& piece : batch.pieces) {
    const std::size_t first_kept = kept;
    for (const std::size_t end = n + std::size_t(piece.count); n < end; ++n) {
      const std::int32_t column = columns[n], row = rows[n];
      const auto tile_x = std::uint32_t(std::clamp(column, 0, last_x)) / kTile, tile_y = std::uint32_t(std::clamp(row, 0, last_y)) / kTile;
      const std::uint8_t hidden = tiles.hidden[std::size_t(tile_y) * std::size_t(tiles.tiles_x) + tile_x];
      // Written in any case and kept by the count: a branch here would be mispredicted at every border of what is visible.
      columns[kept] = column;
      rows[kept] = row;
      phases_x[kept] = phases_x[n];
      phases_y[kept] = phases_y[n];
      records[kept] = records[n];
      areas[kept] = areas[n];
      kept += std::size_t(hidden == 0);
    }
    piece.count = std::int32_t(kept - first_kept);
  }
  batch.voxel_count = kept;
}

}  // namespace slabstream
