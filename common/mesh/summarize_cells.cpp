#include "common/mesh/summarize_cells.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/mesh/mesh_cell.h"
#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

// Any range widens it.
constexpr ValueRange kUnmet = {std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};

void Widen(ValueRange& range, const ValueRange& by) {
  range.min = std::min(range.min, by.min);
  range.max = std::max(range.max, by.max);
}

// What one thread finds.
struct MacrocellRanges {
  ValueRange whole = kUnmet;
  std::vector<ValueRange> bricks;
  std::vector<std::uint32_t> cells;  // by brick
};

MacrocellRanges RangesOf(const Mesh& mesh, const Index3& size) {
  const Index3 counts = CubesOver(size, kBrick);
  const MacrocellRanges none{kUnmet, std::vector<ValueRange>(CountIn(counts), kUnmet), std::vector<std::uint32_t>(CountIn(counts))};
  PerThread<MacrocellRanges> parts;
  ParallelForRanges(0, mesh.tetrahedra.size(), 1, [&](std::size_t first_cell, std::size_t end_cell) {
    MacrocellRanges& part = parts.Mine([&] { return none; });
    for (std::size_t cell = first_cell; cell < end_cell; ++cell) {
      const ValueRange values = ValuesIn(mesh, cell);
      if (values.min > values.max) continue;
      Widen(part.whole, values);
      const CellBounds bounds = BoundsOf(mesh, cell);
      Index3 centre;
      for (int axis = 0; axis < 3; ++axis) {
        centre[axis] = std::clamp(std::int32_t(std::lround((double(bounds.low[axis]) + double(bounds.high[axis])) / 2)), 0, size[axis] - 1);
      }
      ++part.cells[NumberIn(counts, centre / kBrick)];
      const Box bricks = CubesTouched(VoxelsTouched(bounds, size), kBrick);
      for (const Index3& brick : IndicesIn(bricks)) Widen(part.bricks[NumberIn(counts, brick)], values);
    }
  });
  MacrocellRanges all = none;
  parts.ForEach([&](const MacrocellRanges& part) {
    Widen(all.whole, part.whole);
    for (std::size_t brick = 0; brick < all.bricks.size(); ++brick) Widen(all.bricks[brick], part.bricks[brick]);
    std::ranges::transform(all.cells, part.cells, all.cells.begin(), std::plus<>());
  });
  return all;
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

void SummarizeCells(const Mesh& mesh, const Volume& resampled, VolumeSummary& summary) {
  CHECK(summary.description.type == ScalarType::kFloat32 && summary.description.mapping == ValueMapping{});
  MacrocellRanges found = RangesOf(mesh, summary.description.geometry.size);
  if (found.whole.min <= found.whole.max) summary.range = found.whole;
  for (std::size_t brick = 0; brick < found.bricks.size(); ++brick) {
    // All voxels have values of cells that touch them, between the values at the points.
    if (found.bricks[brick].min <= found.bricks[brick].max) summary.bricks[brick] = found.bricks[brick];
  }
  summary.cells = std::move(found.cells);
  summary.histogram = HistogramOf(resampled, summary.range);
}

VolumeSummary SummaryOf(const Volume& volume) { return WithCells(Summarize(volume), volume); }

}  // namespace slabstream
