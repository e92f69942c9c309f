#include "common/renderers/projection_kind.h"

#include <algorithm>

#include "common/calibration/calibration.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream {
AnalyticCost ProjectionKind::MakeCost(const CostBasis& basis) const {
  return [rate = SamplingRateOf(basis.parameters)](const Box& box, const CostView& view) {
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    namespace cost = calibration::projection;
    return cost::kBox + cost::kSample * rate * double(box.voxel_count()) * pixels;
  };
}

ClassificationTable ProjectionKind::DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const {
  ClassificationTable table = Classify(transfer, summary.description, summary.range);
  std::ranges::fill(table.opacity, 1.0F);
  table.max_opacity = 1;
  return table;
}

}  // namespace slabstream
