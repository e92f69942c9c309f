// Exports cases of `slabstream bench` for other renderers: voxels, transfer function and views.
#pragma once

#include "common/base/status.h"
#include "laboratory/bench/bench.h"
#include "laboratory/bench/bench_cases.h"

namespace slabstream {

// Writes to options.export_directory, which exists:
//   DATASET.mha         the volume (cases of one volume share it)
//   CASE.transfer.json  the transfer function as a ParaView colour map, presets resolved
//   CASE.scene.json     both names, renderer, picture size, views and lighting; of a renderer that draws cells
//                       also "grid": the file of the unstructured grid, and its array ("": the file's own choice). The volume is then the
//                       lattice under the grid, whose voxel length opacities belong to
// Overwrites files. The volume is on this machine, never at a service.
Status ExportCase(const BenchCase& bench_case, const BenchOptions& options);

}  // namespace slabstream
