// What a cell store has beside its cells, found in passes over them: they are read part by part, in their order.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/base/status.h"
#include "data/cell_store/stored_cells.h"

namespace slabstream {

struct CellPasses {
  std::string folder;
  const CellArrays* cells = nullptr;  // all but gradients
  VolumeGeometry lattice;
  std::uint64_t part = 0;    // cells at a time, in whole runs
  std::uint64_t memory = 0;  // bytes for sums
  std::function<Status(double done)> progress;
};

// Fills the lattice and finds ranges and runs: writes kRuns, kBricks and kVoxels. Takes memory for the lattice. `whole`: CellStoreFacts.
Status WriteLattice(const CellPasses& passes, CellStoreDigests& digests, ValueRange& whole);
// Writes kGradients, by as many passes as it takes to sum up those of all points.
Status WriteGradients(const CellPasses& passes, CellStoreDigests& digests);

}  // namespace slabstream
