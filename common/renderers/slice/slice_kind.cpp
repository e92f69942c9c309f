// The planning half of slicing: the frame is the picture, supersampled where it is minified; images blend front to back.
#include <memory>
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
class SliceCost : public AnalyticCost {
 public:
  explicit SliceCost(const CostBasis& basis) : drawn_(*basis.drawn), sampling_rate_(SamplingRateOf(basis.parameters, kPlanes)) {
    const VolumeSummary& summary = *basis.summary;
    const Index3 cells = OccupancyCells(drawn_.size);
    tetrahedra_.resize(drawn_.cells.size());
    static_assert(kBrick % kOccupancyCell == 0, "a cell lies in one brick");
    for (std::size_t i = 0; i < tetrahedra_.size() && !summary.cells.empty(); ++i) {
      const Index3 brick = kOccupancyCell * PlaceIn(cells, i) / kBrick;
      const Box voxels = Intersection({kBrick * brick, kBrick * (brick + Uniform(1))}, summary.description.geometry.bounds());
      const double each = double(summary.cells[NumberIn(summary.brick_counts, brick)]) / double(voxels.voxel_count());
      tetrahedra_[i] = float(each * drawn_.cells[i].voxels);
    }
  }

  double Seconds(const Box& box, const CostView& view) const override {
    double drawn = 0, tetrahedra = 0;  // voxels of the lattice
    const Index3 cells = OccupancyCells(drawn_.size);
    VisitCells(box, [&](const Index3& cell, double inside) {
      const std::size_t number = NumberIn(cells, cell);
      drawn += inside * drawn_.cells[number].voxels;
      tetrahedra += inside * double(tetrahedra_[number]);
    });
    if (drawn <= 0) return 0;
    namespace cost = calibration::slice;
    const double pixels = view.pixels_per_voxel * view.pixels_per_voxel;
    return cost::kBox + tetrahedra * cost::kTetrahedron + drawn * pixels * cost::kSample * sampling_rate_;
  }

 private:
  const OccupancyGrid& drawn_;
  std::vector<float> tetrahedra_;  // by cell of `drawn_`: those that may show
  const double sampling_rate_;
};

class SliceKind : public RendererKind {
 public:
  SliceKind()
      : RendererKind({.name = "slice",
                      .title = "slicing",
                      .purpose = "the cells of an unstructured grid, cut by planes parallel to the picture",
                      .abilities = {Ability::kPerspective, Ability::kCells, Ability::kLights, Ability::kTransfer, Ability::kShadows},
                      .stages = {Stage::kTransform, Stage::kSample},
                      .parameters = {SamplingRate(kPlanes)}}) {}

  std::unique_ptr<AnalyticCost> MakeCost(const CostBasis& basis) const override { return std::make_unique<SliceCost>(basis); }
};

}  // namespace

const RendererKind& Kind() {
  static const SliceKind kind;
  return kind;
}

}  // namespace slabstream::slice
