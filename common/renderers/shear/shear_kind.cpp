// The planning half of multi-pass shears: the frame is the picture, supersampled where it is minified; images blend front to back.

#include "common/calibration/calibration.h"
#include "common/renderers/interpolated_table.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"
#include "common/renderers/shear/shear_parameters.h"
#include "common/volume/cells_along.h"

namespace slabstream::shear {
namespace {

// Every beam near drawn voxels is resampled, even if it is hidden: time grows with cells that are drawn at all, and with pixels.
AnalyticCost CostOf(const CostBasis& basis) {
  const double sampling_rate = SamplingRateOf(basis.parameters);
  const double supersampling = basis.parameters.size() > kSupersampling ? SupersamplingOf(basis.parameters) : 1;
  return [=, &drawn = *basis.drawn](const Box& box, const CostView& view) {
    double resampled = 0, shown = 0;  // voxels
    const Index3 cells = OccupancyCells(drawn.size);
    VisitCells(box, [&](const Index3& cell, double inside) {
      const std::uint32_t voxels = drawn.cells[NumberIn(cells, cell)].voxels;
      if (voxels == 0) return;
      resampled += inside * double(OccupancyCellBox(cell, drawn.size).voxel_count());
      shown += inside * voxels;
    });
    if (shown <= 0) return 0.0;
    namespace cost = calibration::shear;
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    return cost::kBox + pixels * (cost::kResample * resampled * supersampling + cost::kSample * sampling_rate * shown);
  };
}

class ShearKind : public RendererKind {
 public:
  ShearKind()
      : RendererKind({.name = "shear",
                      .title = "multi-pass shears",
                      .purpose = "the volume resampled onto the picture's pixels by three one-dimensional passes, with a cubic kernel",
                      .abilities = {Ability::kGradientOpacity, Ability::kLights, Ability::kTransfer, Ability::kShapes},
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
  AnalyticCost MakeCost(const CostBasis& basis) const override { return CostOf(basis); }
};

}  // namespace

const RendererKind& Kind() {
  static const ShearKind kind;
  return kind;
}

}  // namespace slabstream::shear
