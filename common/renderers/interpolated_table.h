// InterpolatedTable: RendererKind::DrawnTable of renderers that classify values between samples.
#pragma once

#include <algorithm>

#include "common/classification/classification_table.h"
#include "common/volume/summary.h"

namespace slabstream {

// Interpolation gives all values between those of two voxels, so a sample between two clear voxels may be visible. A voxel counts as drawn
// if it is at least the lowest visible value or isovalue: without such a voxel, nothing in its reach shows.
inline ClassificationTable InterpolatedTable(const TransferFunction& transfer, const VolumeSummary& summary) {
  ClassificationTable table = Classify(transfer, summary.description, summary.range);
  auto first = std::ranges::find_if(table.opacity, [](float opacity) { return opacity > 0; });
  for (const Isosurface& surface : transfer.isosurfaces) {
    first = std::min(first, table.opacity.begin() + table.BinOf(double(StoredIsovalue(surface.value, summary.description.mapping))));
  }
  if (!transfer.isosurfaces.empty()) table.max_opacity = 1;
  std::for_each(first, table.opacity.end(), [&](float& opacity) { opacity = opacity > 0 ? opacity : table.max_opacity; });
  return table;
}

}  // namespace slabstream
