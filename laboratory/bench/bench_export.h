// Cases of `slabstream bench` for other renderers: the voxels, the curve and the views that it would draw.
#pragma once

#include "common/base/status.h"
#include "laboratory/bench/bench.h"
#include "laboratory/bench/bench_cases.h"

namespace slabstream {

// Writes to options.export_directory, which exists:
//   DATASET.mha         the volume (cases of one volume share it)
//   CASE.transfer.json  the transfer function as a ParaView colour map, presets resolved
//   CASE.scene.json     both names, renderer, picture size, views and lighting
// Files are overwritten. The volume is one of this machine, never of a service.
Status ExportCase(const BenchCase& bench_case, const BenchOptions& options);

}  // namespace slabstream
