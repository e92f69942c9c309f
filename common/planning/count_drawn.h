// Counting what a renderer draws, of a whole volume at once.
#pragma once

#include "common/classification/transfer_function.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/occupancy_grid.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

// The voxels that `renderer` draws under `transfer`: by the samples, or by the cells if it draws those. `summary` is the volume's
// (SummaryOf). Parallel.
OccupancyGrid CountDrawn(const Volume& volume, const VolumeSummary& summary, const RendererKind& renderer,
                         const TransferFunction& transfer);

}  // namespace slabstream
