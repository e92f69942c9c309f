// Which cells hold isosurfaces. A cell is the space between eight neighbouring voxel centres. It holds a surface if one of these voxels
// lies below the isovalue and another one does not.
#pragma once

#include <cstdint>
#include <vector>

#include "worker/rays/macrocell_ranges.h"
#include "worker/rays/ray_look.h"

namespace slabstream {

// By macrocell two numbers, of the cells with even and with odd z there: bit 16 (z / 2) + 4 y + x of number z % 2 is set if the cell at
// (x, y, z) of the macrocell holds one of the isosurfaces. Stored samples that are not finite lie below all isovalues. Parallel.
std::vector<std::int32_t> FindSurfaceCells(const PaddedVoxels& voxels, const MacrocellRanges& cells, const VisibleSamples& visible);

// For EmptyDistances, of FindSurfaceCells: 0 for macrocells with such cells, else 255.
std::vector<std::uint8_t> MacrocellsWithSurfaces(const std::vector<std::int32_t>& surface_cells);

}  // namespace slabstream
