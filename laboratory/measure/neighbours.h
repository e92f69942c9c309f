// Neighbours: how much two renderers on one host slow each other down, because they share caches and memory.
#pragma once

#include "common/planning/frame_plan.h"
#include "common/volume/volume.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

// Two renderings take `first` and `second` seconds alone; started together, both are done after `both` seconds. Returns the factor by which
// each was slower while both ran, less one (MachineModel::memory_slowdown). All > 0. Below 0 only by noise.
double SlowdownOf(double first, double second, double both);

// For two threads that each render half of `volume`, by processor time: pairs of renderings alone and together, in turn. Zero, from no
// pair, if there is one core.
Estimate MeasureSlowdown(const Volume& volume, const FrameSetup& setup);

}  // namespace slabstream
