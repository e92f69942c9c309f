#include "common/planning/count_drawn.h"

#include "common/classification/count_occupied.h"

namespace slabstream {

OccupancyGrid CountDrawn(const Volume& volume, const VolumeSummary& summary, const RendererKind& renderer,
                         const TransferFunction& transfer) {
  const ClassificationTable drawn = renderer.DrawnTable(transfer, summary);
  return renderer.Can(Ability::kCells) ? CountOccupiedByCells(*volume.cells, volume.description, drawn)
                                       : CountOccupied(volume.block, drawn, &summary);
}

}  // namespace slabstream
