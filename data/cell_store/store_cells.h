// Makes a cell store (stored_cells.h) of what a reader has left in a spool.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/mesh/lattice.h"
#include "data/cell_store/cell_spool.h"
#include "data/cell_store/stored_cells.h"

namespace slabstream {

struct CellStoring {
  ValuesAt at = ValuesAt::kPoints;
  Bounds3 bounds;  // of all points
  VolumeGeometry lattice;
  std::array<std::uint64_t, kMostKinds> kinds{};    // CellStoreFacts
  std::vector<std::string> others = {};             // folders of stores that stay meanwhile: one of the same mesh shares its files
  std::vector<std::string> notes = {};              // CellStoreFacts
  std::uint64_t memory = std::uint64_t{256} << 20;  // bytes that it may take, beside four bytes a point and the lattice
  // Called now and then with the share of the work that is done, ascending; an error ends the work.
  std::function<Status(double done)> progress = [](double) { return Status::Ok(); };
};

// The store is the spool's folder, whose spool is removed. Its cells, and all that is derived of them, are those that MoveToLattice,
// SortByPlace, PointGradients, Resample and RangesOf make of the same grid in memory, bit for bit. Errors as of RecordFile;
// ResourceExhausted; those of `progress`. After a failure there is no store, since the header is written last. Parallel.
Status StoreCells(CellSpool spool, const CellStoring& storing);

}  // namespace slabstream
