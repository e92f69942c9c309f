// Summaries of unstructured grids, and of volumes that may be made of one.
#pragma once

#include "common/mesh/mesh.h"
#include "common/volume/summary.h"
#include "common/volume/volume.h"

namespace slabstream {

// Makes the summary of the resampled volume (Summarize) one of the grid: the range is that of the values of all cells, the histogram is
// counted again over it, and the range of each brick is that of the values of all cells whose bounding boxes touch the brick's voxels.
// Cells are counted in the brick in which their bounding boxes have their centres.
// Cells with a value that is not finite do not count: nothing of them is seen. Parallel.
void SummarizeCells(const Mesh& mesh, const Volume& resampled, VolumeSummary& summary);

// Summarize, and SummarizeCells if the volume has cells.
VolumeSummary SummaryOf(const Volume& volume);

}  // namespace slabstream
