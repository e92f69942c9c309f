// The Z-buffer's planning half: the frame is the picture, supersampled where it is minified; only opaque voxels draw.
#include "common/renderers/zbuffer/least_opaque.h"
#include "common/renderers/zbuffer/zbuffer_cost.h"

namespace slabstream::zbuffer {
namespace {

class ZBufferKind : public RendererKind {
 public:
  ZBufferKind()
      : RendererKind({.name = "zbuffer",
                      .title = "Z-buffer",
                      .purpose = "the surfaces of opaque voxels; for solid objects",
                      .format = PixelFormat::kDepth,
                      .reach = kHalo,  // 2 would do; as for splatting, so that both use the same cached voxels
                      .footprint = 1,
                      .stages = {Stage::kZBuffer, Stage::kShade}}) {}

  ClassificationTable DrawnTable(const TransferFunction& transfer, const VolumeSummary& summary) const override {
    ClassificationTable table = Classify(transfer, summary.description, summary.range);
    const float least = LeastOpaque(table, summary.description, summary.range);
    for (float& opacity : table.opacity) opacity = opacity >= least ? opacity : 0;
    return table;
  }
  std::unique_ptr<AnalyticCost> MakeCost(const CostBasis& basis) const override { return std::make_unique<ZBufferCost>(*basis.drawn); }
};

}  // namespace

const RendererKind& Kind() {
  static const ZBufferKind kind;
  return kind;
}

}  // namespace slabstream::zbuffer
