#include "common/planning/render_work.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/planning/cell_range.h"

namespace slabstream {
namespace {

// The smallest box that holds both, which are not empty.
Box HullOf(const Box& a, const Box& b) {
  Box hull;
  for (const Axis axis : kAxes) {
    hull.begin[axis] = std::min(a.begin[axis], b.begin[axis]);
    hull.end[axis] = std::max(a.end[axis], b.end[axis]);
  }
  return hull;
}

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
    const SplatCounts counts = splatting_.Count(box, along);
    if (counts.rows == 0) continue;
    times[std::size_t(Number(along))] =
        kSplatBox + kSlice * counts.slices + kRow * counts.rows + kSegment * counts.segments + kRun * counts.runs + kOctet * counts.octets;
  }
  return times;
}

RenderWork::ByView RenderWork::ZBufferOf(const Box& box) const {
  const CellRange x(box, Axis::kX), y(box, Axis::kY), z(box, Axis::kZ);
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
        surface_cells += x.ShareInside(i) * y.ShareInside(j) * z.ShareInside(k);
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
