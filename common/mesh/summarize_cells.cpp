#include "common/mesh/summarize_cells.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "common/base/check.h"
#include "common/mesh/mesh_cell.h"
#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

void Widen(ValueRange& range, const ValueRange& by) {
  range.min = std::min(range.min, by.min);
  range.max = std::max(range.max, by.max);
}

using Histogram = std::array<std::uint64_t, kHistogramBins>;

Histogram HistogramOf(const Volume& volume, const ValueRange& range) {
  const float* const samples = volume.block.samples<float>();
  PerThread<Histogram> parts;
  ParallelForRanges(0, volume.block.box.voxel_count(), 1, [&](std::int64_t begin, std::int64_t end) {
    Histogram& part = parts.Mine();
    for (std::int64_t i = begin; i < end; ++i) {
      if (std::isfinite(samples[i])) ++part[std::size_t(HistogramBin(range, double(samples[i])))];
    }
  });
  Histogram all{};
  parts.ForEach([&](const Histogram& part) { std::ranges::transform(all, part, all.begin(), std::plus<>()); });
  return all;
}

VolumeSummary WithCells(VolumeSummary summary, const Volume& volume) {
  if (volume.cells != nullptr) SummarizeCells(*volume.cells, volume, summary);
  return summary;
}

}  // namespace

void CellRanges::Add(const CellRanges& other) {
  Widen(whole, other.whole);
  for (std::size_t brick = 0; brick < bricks.size(); ++brick) Widen(bricks[brick], other.bricks[brick]);
  std::ranges::transform(counts, other.counts, counts.begin(), std::plus<>());
}

CellRanges RangesOf(const Mesh& mesh, const Index3& size) {
  const Index3 counts = CubesOver(size, kBrick);
  const CellRanges none{kUnmetRange, std::vector<ValueRange>(CountIn(counts), kUnmetRange), std::vector<std::uint32_t>(CountIn(counts))};
  PerThread<CellRanges> parts;
  ParallelForRanges(0, mesh.tetrahedra.size(), 1, [&](std::size_t first_cell, std::size_t end_cell) {
    CellRanges& part = parts.Mine([&] { return none; });
    for (std::size_t cell = first_cell; cell < end_cell; ++cell) {
      const ValueRange values = ValuesIn(mesh, cell);
      if (values.min > values.max) continue;
      Widen(part.whole, values);
      const CellBounds bounds = BoundsOf(mesh, cell);
      Index3 centre;
      for (int axis = 0; axis < 3; ++axis) {
        centre[axis] = std::clamp(std::int32_t(std::lround((double(bounds.low[axis]) + double(bounds.high[axis])) / 2)), 0, size[axis] - 1);
      }
      ++part.counts[NumberIn(counts, centre / kBrick)];
      const Box bricks = CubesTouched(VoxelsTouched(bounds, size), kBrick);
      for (const Index3& brick : IndicesIn(bricks)) Widen(part.bricks[NumberIn(counts, brick)], values);
    }
  });
  CellRanges all = none;
  parts.ForEach([&](const CellRanges& part) { all.Add(part); });
  return all;
}

void SummarizeCells(CellRanges cells, const Volume& resampled, VolumeSummary& summary) {
  CHECK(summary.description.type == ScalarType::kFloat32 && summary.description.mapping == ValueMapping{});
  if (cells.whole.min <= cells.whole.max) summary.range = cells.whole;
  for (std::size_t brick = 0; brick < cells.bricks.size(); ++brick) {
    // All voxels have values of cells that touch them, between the values at the points.
    if (cells.bricks[brick].min <= cells.bricks[brick].max) summary.bricks[brick] = cells.bricks[brick];
  }
  summary.cells = std::move(cells.counts);
  summary.histogram = HistogramOf(resampled, summary.range);
}

VolumeSummary SummaryOf(const Volume& volume) { return WithCells(Summarize(volume), volume); }

}  // namespace slabstream
