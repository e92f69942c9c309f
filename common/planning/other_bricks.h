// OtherBricks: which bricks of a picture's volume may show something although the volume itself may not: labels that are material, and
// other fields. Labels that tint or hide material show nothing by themselves.
#pragma once

#include <cstdint>
#include <vector>

#include "common/planning/classified_volume.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

// By brick of the summary, which is the volume's, 1: it may show. Conservative. Empty: none does.
std::vector<std::uint8_t> OtherBricks(const VolumeSummary& summary, const ClassifiedVolume& volume);
// Those of its labels alone.
std::vector<std::uint8_t> LabelBricks(const VolumeSummary& summary, const LayerLooks& looks);

// Counts all voxels of those bricks as occupied.
void AddBricks(const std::vector<std::uint8_t>& bricks, const VolumeSummary& summary, OccupancyGrid& grid);

}  // namespace slabstream
