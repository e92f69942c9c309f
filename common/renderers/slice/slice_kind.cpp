// The planning half of slicing: the frame is the picture, supersampled where it is minified; images blend front to back.
#include <utility>
#include <vector>

#include "common/calibration/calibration.h"
#include "common/renderers/renderer_kind.h"
#include "common/renderers/sampling_rate.h"
#include "common/volume/cells_along.h"

namespace slabstream::slice {
namespace {

// Planes in a voxel length. Fewer show stripes where values change within a cell or two, as on flat sides of a grid (docs/rendering.md).
constexpr double kPlanes = 8;

// Every tetrahedron that may show is cut, even if it is hidden: time grows with their number and with samples in drawn voxels of the
// lattice. Those of a brick lie evenly in its voxels, as far as is known.
AnalyticCost CostOf(const CostBasis& basis) {
  const OccupancyGrid& drawn = *basis.drawn;
  const VolumeSummary& summary = *basis.summary;
  const Index3 cells = OccupancyCells(drawn.size);
  std::vector<float> tetrahedra(drawn.cells.size());  // by cell of `drawn`: those that may show
  static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");
  for (std::size_t i = 0; i < tetrahedra.size() && !summary.cells.empty(); ++i) {
    const Index3 brick = kOccupancyCell * PlaceIn(cells, i) / kBrick;
    const Box voxels = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, summary.description.geometry.bounds());
    const double each = double(summary.cells[NumberIn(summary.brick_counts, brick)]) / double(voxels.voxel_count());
    tetrahedra[i] = float(each * drawn.cells[i].voxels);
  }
  const double sampling_rate = SamplingRateOf(basis.parameters, kPlanes);
  return [=, &drawn, tetrahedra = std::move(tetrahedra)](const Box& box, const CostView& view) {
    double voxels = 0, cut = 0;  // of the lattice; tetrahedra
    VisitCells(box, [&](const Index3& cell, double inside) {
      const std::size_t number = NumberIn(cells, cell);
      voxels += inside * drawn.cells[number].voxels;
      cut += inside * double(tetrahedra[number]);
    });
    if (voxels <= 0) return 0.0;
    namespace cost = calibration::slice;
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    return cost::kBox + cut * cost::kTetrahedron + voxels * pixels * cost::kSample * sampling_rate;
  };
}

class SliceKind : public RendererKind {
 public:
  SliceKind()
      : RendererKind({.name = "slice",
                      .title = "slicing",
                      .purpose = "the cells of an unstructured grid, cut by planes parallel to the picture",
                      .abilities = {Ability::kPerspective, Ability::kCells, Ability::kLights, Ability::kTransfer, Ability::kShadows,
                                    Ability::kShapes},
                      .stages = {Stage::kTransform, Stage::kSample},
                      .parameters = {SamplingRate(kPlanes)}}) {}

  AnalyticCost MakeCost(const CostBasis& basis) const override { return CostOf(basis); }
};

}  // namespace

const RendererKind& Kind() {
  static const SliceKind kind;
  return kind;
}

}  // namespace slabstream::slice
