#include "common/renderers/raycast/raycast_cost.h"

#include <algorithm>
#include <cmath>

#include "common/volume/cell_range.h"

namespace slabstream::raycast {
namespace {

// Seconds of one thread: for a box; for each pixel that it covers; for each shaded sample. Measured with the two spheres of 256 voxels a
// side.
constexpr double kBox = 30e-6, kPixel = 60e-9, kSample = 11e-9;
constexpr double kEnd = 6.9;  // -ln of the transmittance at which rays end by default, 1/1024

// The extinction of a voxel length of the largest opacity that many voxels have, finite, >= 0.
double Extinction(const CostBasis& basis) {
  const ClassificationTable table = Classify(*basis.transfer, basis.summary->description, basis.summary->range);
  return -std::log1p(-std::min(double(table.max_opacity), 0.999)) / table.opacity_distance;
}

}  // namespace

RaycastCost::RaycastCost(const CostBasis& basis) : drawn_(*basis.drawn), opaque_depth_(kEnd / std::max(Extinction(basis), 1e-9)) {}

double RaycastCost::Seconds(const Box& box, const CostView& view) const {
  // Columns of cells along the view: material behind opaque material is not sampled.
  const Axis c = view.along, u = c == Axis::kX ? Axis::kY : Axis::kX, v = c == Axis::kZ ? Axis::kY : Axis::kZ;
  const CellRange along(box, c), across_u(box, u), across_v(box, v);
  const Index3 cells = OccupancyCells(drawn_.size);
  constexpr double kCellArea = double(kOccupancyCell) * kOccupancyCell;
  double samples = 0, covered = 0;
  Index3 cell;
  for (cell[v] = across_v.begin; cell[v] < across_v.end; ++cell[v]) {
    for (cell[u] = across_u.begin; cell[u] < across_u.end; ++cell[u]) {
      double depth = 0;  // voxel lengths of material
      for (cell[c] = along.begin; cell[c] < along.end; ++cell[c]) {
        depth += along.ShareInside(cell[c]) * drawn_.cells[NumberIn(cells, cell)].voxels / kCellArea;
      }
      if (depth <= 0) continue;
      const double area = kCellArea * across_u.ShareInside(cell[u]) * across_v.ShareInside(cell[v]);
      samples += area * std::min(depth, opaque_depth_);
      covered += area;
    }
  }
  if (covered <= 0) return 0;
  const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
  return kBox + pixels * (kPixel * covered + kSample * samples);
}

}  // namespace slabstream::raycast
