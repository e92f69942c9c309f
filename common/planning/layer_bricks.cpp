#include "common/planning/layer_bricks.h"

#include <algorithm>
#include <cstddef>

#include "common/frame/matter_labels.h"
#include "common/planning/brick_visibility.h"

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

void AddOverlay(const VolumeSummary& overlay, const RendererKind& renderer, const OverlayLook& look, std::vector<std::uint8_t>& bricks) {
  const BrickVisibility visibility(overlay, renderer.DrawnTable(look.transfer, overlay));
  bricks.resize(overlay.bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (visibility.AnyVisible(i)) bricks[i] = 1;
  }
}

}  // namespace

std::vector<std::uint8_t> LayerBricks(const VolumeSummary& summary, const RendererKind& renderer, const LayerLooks& looks) {
  std::vector<std::uint8_t> bricks;
  if (looks.labels) AddLabels(*summary.labels, *looks.labels, bricks);
  if (looks.overlay) AddOverlay(*summary.overlay, renderer, *looks.overlay, bricks);
  if (std::ranges::count(bricks, 1) == 0) bricks.clear();
  return bricks;
}

void AddLayerBricks(const std::vector<std::uint8_t>& bricks, const VolumeSummary& summary, OccupancyGrid& grid) {
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
