#include "common/planning/other_bricks.h"

#include <algorithm>
#include <cstddef>

#include "common/parallel/parallel.h"
#include "common/planning/brick_visibility.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/affine_map.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

// Whether labels may be material in a box of theirs. Of a level that nobody has read they may be anywhere.
bool AnyMatter(const VolumeSummary& labels, const LabelLook& look, const Box& box) {
  const BrickRangeList& ranges = labels.indexed != nullptr ? *labels.indexed : labels.bricks;
  if (ranges.empty()) return true;
  for (const Index3& brick : IndicesIn(CubesTouched(box, kBrick))) {
    if (MayBeMatter(look, ranges[NumberIn(labels.brick_counts, brick)])) return true;
  }
  return false;
}

// Bricks of the volume at which the field may show: shows(box of its voxels).
template <class Shows>
void AddField(const VolumeSummary& volume, const VolumeSummary& field, std::int32_t reach, Shows&& shows,
              std::vector<std::uint8_t>& bricks) {
  const VolumeGeometry& geometry = volume.description.geometry;
  const Index3& size = field.description.geometry.size;
  const AffineMap map = AffineMapBetween(geometry, field.description.geometry);
  bricks.resize(CountIn(volume.brick_counts));
  ParallelFor(0, volume.brick_counts.z, [&](std::int32_t z) {
    for (const Index3& brick : IndicesIn(Box{{0, 0, z}, {volume.brick_counts.x, volume.brick_counts.y, z + 1}})) {
      const Box box = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, geometry.bounds());
      const Box voxels = CoveringVoxels(box, map, size, reach);
      if (!voxels.empty() && shows(voxels)) bricks[NumberIn(volume.brick_counts, brick)] = 1;
    }
  });
}

}  // namespace

std::vector<std::uint8_t> OtherBricks(const VolumeSummary& summary, const ClassifiedVolume& volume) {
  std::vector<std::uint8_t> bricks;
  const RendererKind& renderer = *volume.renderer();
  for (const ClassifiedField& field : volume.fields()) {
    if (field.labels && field.labels->mode != LabelMode::kSurface) continue;
    if (field.labels) {
      const auto shows = [&](const Box& box) { return AnyMatter(*field.summary, *field.labels, box); };
      AddField(summary, *field.summary, field.labels->smooth ? renderer.reach() : 0, shows, bricks);
    } else {
      const BrickVisibility visibility(*field.summary, renderer.DrawnTable(field.look.transfer, *field.summary));
      AddField(
          summary, *field.summary, renderer.reach(), [&](const Box& box) { return visibility.AnyVisible(box); }, bricks);
    }
  }
  if (std::ranges::count(bricks, 1) == 0) bricks.clear();
  return bricks;
}

void AddBricks(const std::vector<std::uint8_t>& bricks, const VolumeSummary& summary, OccupancyGrid& grid) {
  static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");
  constexpr std::int32_t kCells = kBrick / kOccupancyCell;
  const Index3 cells = OccupancyCells(grid.size);
  for (std::size_t i = 0; i < grid.cells.size() && !bricks.empty(); ++i) {
    const Index3 cell = PlaceIn(cells, i);
    if (bricks[NumberIn(summary.brick_counts, {cell.x / kCells, cell.y / kCells, cell.z / kCells})] == 0) continue;
    grid.cells[i] = FullCell(OccupancyCellBox(cell, grid.size));
  }
}

}  // namespace slabstream
