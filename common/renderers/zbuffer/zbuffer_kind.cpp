// The Z-buffer's planning half: the frame is the picture, supersampled where it is minified; only opaque voxels draw.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/calibration/calibration.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/zbuffer/depth_shading.h"
#include "common/volume/cells_along.h"

namespace slabstream::zbuffer {
namespace {

// The time of a box is that of the cells through which surfaces pass, and of its pixels.
AnalyticCost CostOf(const CostBasis& basis) {
  return [&drawn = *basis.drawn](const Box& box, const CostView& view) {
    const Index3 cells = OccupancyCells(drawn.size);
    double surface_cells = 0;
    Box hull;  // of the cells that hold anything
    VisitCells(box, [&](const Index3& cell, double inside) {
      const std::uint32_t voxels = drawn.cells[NumberIn(cells, cell)].voxels;
      if (voxels == 0) return;
      const Box whole = OccupancyCellBox(cell, drawn.size);
      hull = Hull(hull, Intersection(whole, box));
      if (voxels != whole.voxel_count()) surface_cells += inside;  // else no surface is inside
    });
    if (hull.empty()) return 0.0;
    // The area of the hull's projection at a small elevation, on average over all azimuths: the mean of |cos| and |sin| is 2 / pi, and a
    // third of what lies flat is seen.
    const Index3 size = hull.size();
    const double width = 0.64 * (size.x + size.y), pixels = width * (size.z + width / 3);
    namespace cost = calibration::zbuffer;
    return cost::kBox + cost::kSurfaceCell * surface_cells + cost::kPixel * pixels * view.pixels_per_voxel * view.pixels_per_voxel;
  };
}

class ZBufferKind : public RendererKind {
 public:
  ZBufferKind()
      : RendererKind({.name = "zbuffer",
                      .title = "Z-buffer",
                      .purpose = "the surfaces of opaque voxels; for solid objects",
                      .format = PixelFormat::kDepth,
                      .abilities = {Ability::kPerspective, Ability::kIsosurfaces, Ability::kLabels, Ability::kLights,
                                    Ability::kDepthShading, Ability::kTransfer, Ability::kShadows, Ability::kShapes},
                      .stages = {Stage::kZBuffer, Stage::kShade}}) {}

  // A voxel is opaque if it has half of the largest opacity in the volume's range of values, or at least an isovalue: then it has the
  // colour of the greatest one that it reaches. All other bins are clear.
  ClassificationTable Table(const TransferFunction& transfer, const VolumeDescription& description, ValueRange range) const override {
    ClassificationTable table = Classify(transfer, description, range);
    const float least = 0.5F * MaxOpacity(table, description, range);
    for (float& opacity : table.opacity) opacity = opacity >= least ? opacity : 0;
    for (const Isosurface& surface : transfer.isosurfaces) {
      for (std::size_t bin = 0; bin < table.opacity.size(); ++bin) {
        if (table.value[bin] < surface.value) continue;
        table.opacity[bin] = 1;
        table.color[bin] = surface.color;
      }
    }
    table.max_opacity = *std::ranges::max_element(table.opacity);
    return table;
  }
  AnalyticCost MakeCost(const CostBasis& basis) const override { return CostOf(basis); }

  LocalImage Finish(const LocalImage& frame, const FrameSetup& setup) const override {
    const bool by_depth = setup.shading.model == ShadingModel::kDepthGradient;
    LocalImage picture = RendererKind::Finish(by_depth ? ShadeByDepth(frame, setup) : frame, setup);
    if (setup.unit == 1) return picture;
    for (float& depth : picture.depth) {
      if (std::isfinite(depth)) depth = float(std::min(depth * setup.unit, double(std::numeric_limits<float>::max())));
    }
    return picture;
  }

 protected:
  bool FinishCopies(const FrameSetup& setup) const override {
    return setup.shading.model != ShadingModel::kDepthGradient && setup.unit == 1 && RendererKind::FinishCopies(setup);
  }
};

}  // namespace

const RendererKind& Kind() {
  static const ZBufferKind kind;
  return kind;
}

}  // namespace slabstream::zbuffer
