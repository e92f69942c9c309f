#include "common/planning/render_work.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace slabstream {
namespace {

constexpr double kRowsOfCell = kOccupancyCell * kOccupancyCell;

// The smallest box that holds both, which are not empty.
Box HullOf(const Box& a, const Box& b) {
  Box hull;
  for (const Axis axis : kAxes) {
    hull.begin[axis] = std::min(a.begin[axis], b.begin[axis]);
    hull.end[axis] = std::max(a.end[axis], b.end[axis]);
  }
  return hull;
}

// Cells of a box along one axis, and how much of each of them lies inside: of `box`, and of `reach` round it.
struct CellRange {
  CellRange(const Box& box, const Box& reach, Axis axis, const Index3& size)
      : begin(reach.begin[axis] / kOccupancyCell), end((reach.end[axis] - 1) / kOccupancyCell + 1) {
    for (std::int32_t cell = begin; cell < end; ++cell) {
      own.push_back(CellShare(box, axis, cell, size));
      reached.push_back(CellShare(reach, axis, cell, size));
    }
  }
  std::size_t size() const { return own.size(); }

  std::int32_t begin, end;
  std::vector<double> own, reached;
};

}  // namespace

ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary, RendererKind renderer) {
  ClassificationTable table = Classify(transfer, summary.description, summary.range);
  if (renderer == RendererKind::kZBuffer) {
    const float least = 0.5F * MaxOpacity(table, summary.description, summary.range);
    for (float& opacity : table.opacity) opacity = opacity >= least ? opacity : 0;
  }
  return table;
}

double MedianExtinction(const TransferFunction& transfer, const VolumeSummary& summary) {
  constexpr double kMostOpacity = 0.999;  // 1 would be infinite
  const ClassificationTable table = Classify(transfer, summary.description, summary.range);
  const auto histogram_bin = [&](std::size_t bin) {
    const double stored = table.stored_origin + double(bin) / table.bin_from_stored_scale;
    return std::size_t(HistogramBin(summary.range, summary.description.mapping.FromStored(stored)));
  };
  std::array<int, kHistogramBins> sharing{};  // bins of the table, by bin of the histogram
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) ++sharing[histogram_bin(bin)];
  std::vector<std::pair<double, double>> shown;  // opacity and number of voxels
  double voxels = 0;
  for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) {
    if (table.opacity[bin] <= 0) continue;
    shown.emplace_back(table.opacity[bin], double(summary.histogram[histogram_bin(bin)]) / sharing[histogram_bin(bin)]);
    voxels += shown.back().second;
  }
  std::ranges::sort(shown);
  double below = 0;
  for (const auto& [opacity, count] : shown) {
    below += count;
    if (below >= voxels / 2) return -std::log1p(-std::min(opacity, kMostOpacity)) / table.opacity_distance;
  }
  return 0;
}

RenderWork::ByView RenderWork::Of(const Box& box) const { return renderer_ == RendererKind::kZBuffer ? ZBufferOf(box) : SplattingOf(box); }

RenderWork::ByView RenderWork::SplattingOf(const Box& box) const {
  ByView times{};
  for (const Axis along : {Axis::kX, Axis::kY}) {
    const Seen from_below = See(box, along, true), from_above = See(box, along, false);
    if (from_below.octets == 0) return {};
    times[std::size_t(Number(along))] =
        kSplatBox + 0.5 * (kRow * (from_below.rows + from_above.rows) + kOctet * (from_below.octets + from_above.octets));
  }
  return times;
}

RenderWork::Seen RenderWork::See(const Box& box, Axis along, bool ascending) const {
  const Box reach = Grown(box, kRim, {{0, 0, 0}, grid_.size});
  const Axis beam = along == Axis::kX ? Axis::kY : Axis::kX;
  const CellRange slices(box, reach, along, grid_.size), beams(box, reach, beam, grid_.size), rows(box, reach, Axis::kZ, grid_.size);
  const Index3 cells = OccupancyCells(grid_.size);
  const auto step = [&](Axis axis) { return axis == Axis::kX ? std::size_t{1} : std::size_t(cells.x); };
  Seen seen;
  std::vector<double> open(beams.size());  // share of the rays through these cells that nothing has stopped yet
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::ranges::fill(open, 1.0);
    for (std::size_t s = 0; s < slices.size(); ++s) {
      const std::size_t slice = ascending ? s : slices.size() - 1 - s;
      const CellOccupancy* cell = &grid_.cells[(std::size_t(rows.begin) + k) * std::size_t(cells.x) * std::size_t(cells.y) +
                                               (std::size_t(slices.begin) + slice) * step(along) + std::size_t(beams.begin) * step(beam)];
      double empty = 1;  // share of the beams that hold nothing to be seen
      for (std::size_t i = 0; i < beams.size(); ++i, cell += step(beam)) {
        if (cell->voxels == 0) continue;
        const double along_beam = open[i] * (beam == Axis::kX ? cell->rows_x : cell->rows_y);
        seen.octets += along_beam * beams.reached[i] * slices.reached[slice] * rows.reached[k];
        empty *= 1 - along_beam / kRowsOfCell;
        const double along_ray = along == Axis::kX ? cell->rows_x : cell->rows_y;
        const double depth = extinction_ * cell->voxels / along_ray * slices.reached[slice];
        open[i] *= 1 - along_ray / kRowsOfCell * std::min(1.0, depth / kOpaqueDepth);
      }
      seen.rows += kRowsOfCell * (1 - empty * empty) * slices.own[slice] * rows.reached[k];
    }
  }
  return seen;
}

RenderWork::ByView RenderWork::ZBufferOf(const Box& box) const {
  const CellRange x(box, box, Axis::kX, grid_.size), y(box, box, Axis::kY, grid_.size), z(box, box, Axis::kZ, grid_.size);
  const Index3 cells = OccupancyCells(grid_.size);
  double surface_cells = 0;
  Box drawn;  // cells that hold anything
  for (std::int32_t k = z.begin; k < z.end; ++k) {
    for (std::int32_t j = y.begin; j < y.end; ++j) {
      for (std::int32_t i = x.begin; i < x.end; ++i) {
        const CellOccupancy& cell =
            grid_.cells[(std::size_t(k) * std::size_t(cells.y) + std::size_t(j)) * std::size_t(cells.x) + std::size_t(i)];
        if (cell.voxels == 0) continue;
        const Box place = Intersection(OccupancyCellBox({i, j, k}, grid_.size), box);
        drawn = drawn.empty() ? place : HullOf(drawn, place);
        if (cell.voxels == OccupancyCellBox({i, j, k}, grid_.size).voxel_count()) continue;  // inside
        surface_cells += x.own[std::size_t(i - x.begin)] * y.own[std::size_t(j - y.begin)] * z.own[std::size_t(k - z.begin)];
      }
    }
  }
  if (drawn.empty()) return {};
  // Its shadow at a small elevation, on average over all azimuths: |cos| and |sin| are 2 / pi, and of what lies flat a third is seen.
  const Index3 size = drawn.size();
  const double width = 0.64 * (size.x + size.y), pixels = width * (size.z + width / 3);
  const double time = kZBufferBox + kSurfaceCell * surface_cells + kPixel * pixels;
  return {time, time};
}

}  // namespace slabstream
