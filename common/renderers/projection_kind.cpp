#include "common/renderers/projection_kind.h"

#include <algorithm>

#include "common/calibration/calibration.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream {
namespace {

class ProjectionCost : public AnalyticCost {
 public:
  explicit ProjectionCost(double sampling_rate) : sampling_rate_(sampling_rate) {}
  double Seconds(const Box& box, const CostView& view) const override {
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    namespace cost = calibration::projection;
    return cost::kBox + cost::kSample * sampling_rate_ * double(box.voxel_count()) * pixels;
  }

 private:
  const double sampling_rate_;
};

}  // namespace

std::unique_ptr<AnalyticCost> ProjectionKind::MakeCost(const CostBasis& basis) const {
  return std::make_unique<ProjectionCost>(SamplingRateOf(basis.parameters));
}

ClassificationTable ProjectionKind::DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const {
  ClassificationTable table = Classify(transfer, summary.description, summary.range);
  std::ranges::fill(table.opacity, 1.0F);
  table.max_opacity = 1;
  return table;
}

}  // namespace slabstream
