// Neighbours: how much two renderers of one host slow each other down, for they share caches and memory.
#pragma once

#include "common/planning/frame_plan.h"
#include "common/volume/volume.h"
#include "laboratory/measure/statistics.h"

namespace slabstream {

// Two renderings that take `first` and `second` seconds alone and are both done after `both` seconds when they begin at once: how many
// times as long, less one, each took while both ran (MachineModel::memory_slowdown). All > 0. Below 0 by noise alone.
double SlowdownOf(double first, double second, double both);

// Of two threads that render `volume`, each half of it, by processor time: pairs of renderings alone and at once, in turn. Zero, of no
// pair, where there is one core.
Estimate MeasureSlowdown(const Volume& volume, const FrameSetup& setup);

}  // namespace slabstream
