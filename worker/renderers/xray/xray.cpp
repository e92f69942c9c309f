// The pixel half of radiographs: sums of attenuation along each ray, as shares of that of the volume's largest value. docs/rendering.md
// defines them.
#include "common/renderers/xray/attenuation.h"
#include "worker/rays/bounds_cache.h"
#include "worker/rays/project.h"
#include "worker/rays/render_pieces.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::xray {
namespace {

class XrayRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    StageClock clock(report);
    const std::vector<RayPiece>& pieces = data.CacheOf<RayVolume>().PiecesOf(data);
    BoundsCache& bounds = data.CacheOf<BoundsCache>();
    const std::vector<SampleBounds>&most = bounds.Of(pieces, 1), &least = bounds.Of(pieces, -1);
    clock.Charge(Stage::kPrepare);

    const VolumeDescription& volume = setup.description;
    const ViewRays rays = MakeViewRays(setup.camera, volume.geometry, setup.parameters.at(0), setup.clip);
    const auto values = MakeValueScale(AttenuationOf(setup).clear, MostAttenuating(setup), volume.mapping);
    const FragmentOrder order(setup);
    LocalImage image = RenderPieces(
        pieces, {at, setup, rays, hidden, control, report}, [&](std::size_t /*piece*/) { return kEverywhere; },
        [&](std::size_t piece, const RayBox& ray_box, const PixelBounds& tile, std::uint8_t /*steps*/, float* pixels,
            std::size_t floats_a_row) {
          const ShapeTile* const shapes = TileOf(data.shapes(), tile);
          ProjectTile({.rays = &rays,
                       .box = &ray_box,
                       .bounds = &most[piece],
                       .values = values,
                       .shapes = shapes,
                       .order = &order,
                       .opposite = &least[piece]},
                      tile, pixels, floats_a_row);
        });
    return clock.Finish(std::move(image), control);
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<XrayRenderer>(); }

}  // namespace slabstream::xray
