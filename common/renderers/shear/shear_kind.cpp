// The planning half of multi-pass shears: the frame is the picture, supersampled where it is minified; images blend front to back.
#include <algorithm>

#include "common/calibration/calibration.h"
#include "common/renderers/interpolated_table.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"
#include "common/renderers/shear/shear_parameters.h"
#include "common/volume/cells_along.h"

namespace slabstream::shear {
namespace {

// Every beam near drawn voxels is resampled, even if it is hidden: time grows with cells that are drawn at all, and with pixels.
class ShearCost : public AnalyticCost {
 public:
  explicit ShearCost(const CostBasis& basis) : drawn_(*basis.drawn), sampling_rate_(SamplingRateOf(basis.parameters)) {
    if (basis.parameters.size() > kSupersampling) supersampling_ = SupersamplingOf(basis.parameters);
  }

  double Seconds(const Box& box, const CostView& view) const override {
    double resampled = 0, drawn = 0;  // voxels
    const Index3 cells = OccupancyCells(drawn_.size);
    VisitCells(box, [&](const Index3& cell, double inside) {
      const std::uint32_t voxels = drawn_.cells[NumberIn(cells, cell)].voxels;
      if (voxels == 0) return;
      resampled += inside * double(OccupancyCellBox(cell, drawn_.size).voxel_count());
      drawn += inside * voxels;
    });
    if (drawn <= 0) return 0;
    namespace cost = calibration::shear;
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    return cost::kBox + pixels * (cost::kResample * resampled * supersampling_ + cost::kSample * sampling_rate_ * drawn);
  }

 private:
  const OccupancyGrid& drawn_;
  const double sampling_rate_;
  double supersampling_ = 1;
};

class ShearKind : public RendererKind {
 public:
  ShearKind()
      : RendererKind({.name = "shear",
                      .title = "multi-pass shears",
                      .purpose = "the volume resampled onto the picture's pixels by three one-dimensional passes, with a cubic kernel",
                      .abilities = {Ability::kGradientOpacity, Ability::kLights, Ability::kTransfer},
                      .parameters = {SamplingRate(),
                                     {.name = "kernel",
                                      .purpose = "Reconstruction between samples, along one axis at a time",
                                      .standard = double(Kernel::kCatmullRom),
                                      .choices = {"catmull-rom", "mitchell", "b-spline", "linear"}},
                                     {.name = "supersampling",
                                      .purpose = "Beams and slices resampled for each one of the volume",
                                      .standard = 0,
                                      .choices = {"1", "2", "3", "4"}}}}) {}

  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override {
    return InterpolatedTable(transfer, summary);
  }
  std::unique_ptr<AnalyticCost> MakeCost(const CostBasis& basis) const override { return std::make_unique<ShearCost>(basis); }
};

}  // namespace

const RendererKind& Kind() {
  static const ShearKind kind;
  return kind;
}

}  // namespace slabstream::shear
