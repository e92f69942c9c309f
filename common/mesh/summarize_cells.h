// Summaries of unstructured grids, and of volumes that may be made of one.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

inline constexpr ValueRange kUnmetRange = {std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};  // any widens it

// What is known of the values of cells. Those with a value that is not finite do not count: nothing of them is seen.
struct CellRanges {
  ValueRange whole = kUnmetRange;     // of all cells
  std::vector<ValueRange> bricks;     // of the cells whose bounding boxes touch the brick's voxels
  std::vector<std::uint32_t> counts;  // by brick: cells whose bounding boxes have their centres there

  // Adds those of other cells, on the same lattice.
  void Add(const CellRanges& other);
};
// On a lattice of `size`. Parallel.
CellRanges RangesOf(const Mesh& mesh, const Index3& size);

// Makes the summary of the resampled volume (Summarize) one of the grid: ranges are those of the cells, and the histogram is counted again
// over the whole one. Parallel.
void SummarizeCells(CellRanges cells, const Volume& resampled, VolumeSummary& summary);
inline void SummarizeCells(const Mesh& mesh, const Volume& resampled, VolumeSummary& summary) {
  SummarizeCells(RangesOf(mesh, summary.description.geometry.size), resampled, summary);
}

// Summarize, and SummarizeCells if the volume has cells.
VolumeSummary SummaryOf(const Volume& volume);

}  // namespace slabstream
