// Where a field with a grid of its own may show something in a piece of the volume, by cells of both.
#pragma once

#include <cstdint>
#include <vector>

#include "common/volume/affine_map.h"
#include "worker/rays/ray_volume.h"

namespace slabstream {

// By cell of `piece`, 1: a cell of `field` that shows (VisibleCells) touches it. `map`: from voxels of the volume to those of the field.
// Parallel.
std::vector<std::uint8_t> CellsThatShow(const RayPiece& piece, const RayPiece& field, const AffineMap& map,
                                        const std::vector<std::uint8_t>& visible);

// VisibleCells of a field whose samples depend on voxels of the cells around theirs, too: neighbours of cells that show something show it.
void SpreadToNeighbours(const Index3& counts, std::vector<std::uint8_t>& visible);

}  // namespace slabstream
