// Splatting's planning half: the frame is an image along the slices of the volume (sheet_grid.h), and all voxels that show anything draw.
#include <fmt/format.h>

#include <algorithm>

#include "common/renderers/splat/splat_cost.h"

namespace slabstream::splat {
namespace {

Status CheckGrid(const SheetGrid& sheets) {
  if (std::max(sheets.width, sheets.height) <= kMaxGridSide) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("an image along the slices of this view has {} x {} pixels, but at most {} a side are possible: "
                  "the slices lie too far apart for the width of their voxels",
                  sheets.width, sheets.height, kMaxGridSide));
}

class SplatKind : public RendererKind {
 public:
  SplatKind()
      : RendererKind(
            {.name = "splat",
             .title = "splatting",
             .purpose = "soft footprints of all visible voxels; for translucent volumes",
             .derived_from_stored = 2,  // bricks of the voxels, and their cells
             .opacity_by_value = true,
             .along_slices = true,
             .abilities = {Ability::kPerspective, Ability::kLights, Ability::kTransfer, Ability::kShadows, Ability::kShapes},
             .footprint = 4,
             .stages = {Stage::kTransform, Stage::kShade, Stage::kSplat, Stage::kComposite},
             .parameters = {{.name = "footprint",
                             .purpose = "Width of footprints, times the usual one: wider ones smooth noise; they reach at most 6 voxels",
                             .standard = 1,
                             .least = 1,
                             .most = kMaxFootprint}}}) {}

  Status SetView(const ViewParameters& view, ImageSize size, FrameSetup& setup) const override {
    const VolumeGeometry& geometry = setup.description.geometry;
    setup.camera = MakeCamera(view, size, geometry);
    setup.sheets = MakeSheetGrid(setup.camera, geometry, setup.parameters.front());
    return CheckGrid(setup.sheets);
  }
  AnalyticCost MakeCost(const CostBasis& basis) const override {
    return SplatCost(*basis.drawn, basis.summary->description.geometry.spacing, MedianExtinction(*basis.transfer, *basis.summary));
  }
};

}  // namespace

const RendererKind& Kind() {
  static const SplatKind kind;
  return kind;
}

}  // namespace slabstream::splat
