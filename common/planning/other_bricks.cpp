#include "common/planning/other_bricks.h"

#include <algorithm>
#include <cstddef>

#include "common/frame/matter_labels.h"
#include "common/parallel/parallel.h"
#include "common/planning/brick_visibility.h"
#include "common/renderers/renderer_kind.h"
#include "common/volume/affine_map.h"
#include "common/volume/indices.h"

namespace slabstream {
namespace {

void AddLabels(const VolumeSummary& labels, const LabelLook& look, std::vector<std::uint8_t>& bricks) {
  const MatterLabels matter(look);
  if (!matter.any()) return;
  bricks.resize(labels.bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (matter.AnyBetween(labels.bricks[i].min, labels.bricks[i].max)) bricks[i] = 1;
  }
}

// Bricks of the volume at which the field may show.
void AddField(const VolumeSummary& volume, const ClassifiedField& field, const RendererKind& renderer, std::vector<std::uint8_t>& bricks) {
  const BrickVisibility visibility(*field.summary, renderer.DrawnTable(field.look.transfer, *field.summary));
  const VolumeGeometry& geometry = volume.description.geometry;
  const Index3& size = field.summary->description.geometry.size;
  const AffineMap map = AffineMapBetween(geometry, field.summary->description.geometry);
  bricks.resize(CountIn(volume.brick_counts));
  ParallelFor(0, volume.brick_counts.z, [&](std::int32_t z) {
    for (const Index3& brick : IndicesIn(Box{{0, 0, z}, {volume.brick_counts.x, volume.brick_counts.y, z + 1}})) {
      const Box box = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, geometry.bounds());
      const Box voxels = CoveringVoxels(box, map, size, renderer.reach());
      if (!voxels.empty() && visibility.AnyVisible(voxels)) bricks[NumberIn(volume.brick_counts, brick)] = 1;
    }
  });
}

}  // namespace

std::vector<std::uint8_t> OtherBricks(const VolumeSummary& summary, const ClassifiedVolume& volume) {
  std::vector<std::uint8_t> bricks = LabelBricks(summary, volume.looks());
  for (const ClassifiedField& field : volume.fields()) AddField(summary, field, *volume.renderer(), bricks);
  if (std::ranges::count(bricks, 1) == 0) bricks.clear();
  return bricks;
}

std::vector<std::uint8_t> LabelBricks(const VolumeSummary& summary, const LayerLooks& looks) {
  std::vector<std::uint8_t> bricks;
  if (looks.labels) AddLabels(*summary.labels, *looks.labels, bricks);
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
