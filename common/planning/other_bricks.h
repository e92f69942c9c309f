// OtherBricks: which bricks of a picture's volume may show something although the volume itself may not: other fields. Labels
// show by themselves if they are material, and not if they tint or hide that of the volume.
#pragma once

#include <cstdint>
#include <vector>

#include "common/planning/classified_volume.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

// By brick of the summary, which is the volume's, 1: it may show. Conservative. Empty: none does.
std::vector<std::uint8_t> OtherBricks(const VolumeSummary& summary, const ClassifiedVolume& volume);

// Counts all voxels of those bricks as occupied.
void AddBricks(const std::vector<std::uint8_t>& bricks, const VolumeSummary& summary, OccupancyGrid& grid);

}  // namespace slabstream
