// The ray caster's planning half: the frame is the picture, supersampled where it is minified; images blend front to back.
#include <algorithm>

#include "common/renderers/raycast/raycast_cost.h"
#include "common/renderers/sampling_rate.h"

namespace slabstream::raycast {
namespace {

class RaycastKind : public RendererKind {
 public:
  RaycastKind()
      : RendererKind({.name = "raycast",
                      .title = "ray casting",
                      .purpose = "trilinear samples along each pixel's ray, for sharp surfaces inside translucent material",
                      .format = PixelFormat::kRgba,
                      .reach = kHalo,  // 2 would do; like the other renderers, so that all use the same cached voxels
                      .footprint = 1,
                      .stages = {Stage::kSample},
                      .parameters = {SamplingRate()}}) {}

  // Interpolation gives all values between those of two voxels, so a sample between two clear voxels may be visible. A voxel counts as
  // drawn if it is at least the lowest visible value: without such a voxel, nothing in its reach shows.
  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override {
    ClassificationTable table = Classify(transfer, summary.description, summary.range);
    const auto first = std::ranges::find_if(table.opacity, [](float opacity) { return opacity > 0; });
    std::for_each(first, table.opacity.end(), [&](float& opacity) { opacity = opacity > 0 ? opacity : table.max_opacity; });
    return table;
  }
  std::unique_ptr<AnalyticCost> MakeCost(const CostBasis& basis) const override { return std::make_unique<RaycastCost>(basis); }
};

}  // namespace

const RendererKind& Kind() {
  static const RaycastKind kind;
  return kind;
}

}  // namespace slabstream::raycast
