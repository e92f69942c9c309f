// LayerBricks: which bricks of a volume layers may show under any transfer function. Labels that tint or hide material show
// nothing by themselves.
#pragma once

#include <cstdint>
#include <vector>

#include "common/frame/layer_look.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"

namespace slabstream {

// By brick of the summary, 1: it may be shown. Conservative. Empty: none is.
std::vector<std::uint8_t> LayerBricks(const VolumeSummary& summary, const RendererKind& renderer, const LayerLooks& looks);

// Counts all voxels of those bricks as occupied.
void AddLayerBricks(const std::vector<std::uint8_t>& bricks, const VolumeSummary& summary, OccupancyGrid& grid);

}  // namespace slabstream
