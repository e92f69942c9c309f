// The ray caster's planning half: the frame is the picture, supersampled where it is minified; images blend front to back.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/calibration/calibration.h"
#include "common/renderers/interpolated_table.h"
#include "common/renderers/raycast/raycast_parameters.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"
#include "common/volume/cells_along.h"

namespace slabstream::raycast {
namespace {

// One sample a voxel leaves rings on smooth surfaces under steep transfer functions; docs/rendering.md has a table of errors and times.
constexpr double kSamplesAVoxel = 2;

// The extinction of a voxel length of the largest opacity that many voxels have, finite, >= 0.
double Extinction(const CostBasis& basis) {
  const ClassificationTable table = Classify(*basis.transfer, basis.summary->description, basis.summary->range);
  return -std::log1p(-std::min(double(table.max_opacity), 0.999)) / table.opacity_distance;
}

// The time of a box is that of the pixels that it covers and of their shaded samples. Of isosurfaces alone, voxels are read where a surface
// passes through: in cells that are drawn in part. Rays leap through the others.
AnalyticCost CostOf(const CostBasis& basis) {
  constexpr double kEnd = 6.9;  // -ln of the transmittance at which rays end by default, 1/1024
  const double extinction = Extinction(basis);
  const double opaque_depth = kEnd / std::max(extinction, 1e-9);  // voxel lengths of material after which rays end
  const bool surfaces_alone = !(extinction > 0) && !basis.transfer->isosurfaces.empty();
  const double sampling_rate = SamplingRateOf(basis.parameters, kSamplesAVoxel);
  return [=, &drawn = *basis.drawn](const Box& box, const CostView& view) {
    // Columns of cells along the view: material behind opaque material is not sampled.
    const auto [c, u, v] = AxesOf(view.along);
    const CellsAlong along(box, c), across_u(box, u), across_v(box, v);
    const Index3 cells = OccupancyCells(drawn.size);
    constexpr double kCellArea = double(kOccupancyCell) * kOccupancyCell;
    double depths = 0, covered = 0;  // voxel lengths of sampled material, and rays, at a pixel a voxel
    Index3 cell;
    for (cell[v] = across_v.begin; cell[v] < across_v.end; ++cell[v]) {
      for (cell[u] = across_u.begin; cell[u] < across_u.end; ++cell[u]) {
        double depth = 0;  // voxel lengths of material
        for (cell[c] = along.begin; cell[c] < along.end; ++cell[c]) {
          const std::uint32_t voxels = drawn.cells[NumberIn(cells, cell)].voxels;
          if (!surfaces_alone) {
            depth += along.ShareInside(cell[c]) * voxels / kCellArea;
          } else if (voxels != 0) {
            const bool full = voxels == OccupancyCellBox(cell, drawn.size).voxel_count();
            depth += along.ShareInside(cell[c]) * (full ? 1 : kOccupancyCell);
          }
        }
        if (depth <= 0) continue;
        const double area = kCellArea * across_u.ShareInside(cell[u]) * across_v.ShareInside(cell[v]);
        depths += area * std::min(depth, opaque_depth);
        covered += area;
      }
    }
    if (covered <= 0) return 0.0;
    namespace cost = calibration::raycast;
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    return cost::kBox + pixels * (cost::kPixel * covered + cost::kSample * sampling_rate * depths);
  };
}

class RaycastKind : public RendererKind {
 public:
  RaycastKind()
      : RendererKind({.name = "raycast",
                      .title = "ray casting",
                      .purpose = "trilinear samples along each pixel's ray, for sharp surfaces inside translucent material",
                      .reach = kRayReach,
                      .derived_from_stored = kRayDerived,
                      .opacity_by_value = true,
                      .abilities = {Ability::kPerspective, Ability::kIsosurfaces, Ability::kGradientOpacity, Ability::kLabels,
                                    Ability::kLights, Ability::kTransfer, Ability::kLevels, Ability::kShadows, Ability::kRegions,
                                    Ability::kFields, Ability::kSmoothLabels, Ability::kRectilinear, Ability::kShapes},
                      .parameters = {SamplingRate(kSamplesAVoxel),
                                     {.name = "jitter",
                                      .purpose = "Move the samples of each ray by up to this share of the way to the next one, in a "
                                                 "fixed pattern: rings become a fine grain",
                                      .standard = 0,
                                      .least = 0,
                                      .most = 1},
                                     {.name = "gradient",
                                      .purpose = "Gradients that light uses: plain differences of neighbouring voxels, or smoothed "
                                                 "ones, so that stripes and noise get weaker close up",
                                      .standard = double(GradientKind::kCentral),
                                      .choices = {"central", "smooth"}}}}) {}

  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override {
    return InterpolatedTable(transfer, summary);
  }
  AnalyticCost MakeCost(const CostBasis& basis) const override { return CostOf(basis); }

  Status SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) const override {
    const double jitter = setup.parameters.at(kJitter);
    if (setup.description.geometry.rectilinear() && jitter > 0) {
      return Status::InvalidArgument(fmt::format("jitter is {}, must be 0 on a rectilinear grid; --resample even resamples it", jitter));
    }
    return RendererKind::SetView(view, size, setup);
  }
};

}  // namespace

const RendererKind& Kind() {
  static const RaycastKind kind;
  return kind;
}

}  // namespace slabstream::raycast
