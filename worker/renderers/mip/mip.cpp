// The pixel half of intensity projections: the largest, the least or the mean sample along each ray. docs/rendering.md defines them.
#include <array>

#include "common/renderers/mip/projection_mode.h"
#include "worker/rays/project.h"
#include "worker/rays/render_pieces.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::mip {
namespace {

// Bounds of a padded box's cells, by piece.
class BoundsCache : public BoxCache {
 public:
  const std::vector<SampleBounds>& Of(const std::vector<RayPiece>& pieces, float sign) {
    std::vector<SampleBounds>& bounds = by_sign_[sign > 0 ? 1 : 0];
    if (bounds.empty()) {
      for (const RayPiece& piece : pieces) bounds.push_back(BoundSamples(piece.cells, sign));
    }
    return bounds;
  }

  std::size_t bytes() const override {
    std::size_t total = 0;
    for (const auto& bounds : by_sign_) {
      for (const SampleBounds& piece : bounds) total += piece.bytes();
    }
    return total;
  }

 private:
  std::array<std::vector<SampleBounds>, 2> by_sign_;
};

class MipRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    StageClock clock(report);
    const ProjectionMode mode = ModeOf(setup);
    // If data values fall as stored samples rise, the largest value belongs to the least sample.
    const ValueMapping& mapping = setup.description.mapping;
    const bool largest = (mode == ProjectionMode::kMaximum) == (mapping.scale >= 0);
    const std::vector<RayPiece>& pieces = data.CacheOf<RayVolume>().PiecesOf(data);
    const float sign = largest ? 1.0F : -1.0F;
    const std::vector<SampleBounds>* const bounds = mode == ProjectionMode::kMean ? nullptr : &data.CacheOf<BoundsCache>().Of(pieces, sign);
    clock.Charge(Stage::kPrepare);

    const ViewRays rays = MakeViewRays(setup.camera, setup.description.geometry, SamplesPerVoxel(setup), setup.clip);
    const auto [least, largest_value] = ProjectedValuesOf(setup);
    const ValueScale values = MakeValueScale(least, largest_value, mapping);
    LocalImage image = RenderPieces(
        pieces, {at, setup, rays, hidden, control, report}, [&](std::size_t /*piece*/) { return kEverywhere; },
        [&](std::size_t piece, const RayBox& ray_box, const PixelBounds& tile, std::uint8_t /*steps*/, float* pixels,
            std::size_t floats_a_row) {
          const ProjectWork work = {.rays = &rays,
                                    .box = &ray_box,
                                    .bounds = bounds == nullptr ? nullptr : &(*bounds)[piece],
                                    .sign = sign,
                                    .values = values,
                                    .complement = mode == ProjectionMode::kMinimum,
                                    .nearest = TakesNearestVoxel(setup)};
          ProjectTile(work, tile, pixels, floats_a_row);
        });
    return clock.Finish(std::move(image), control);
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<MipRenderer>(); }

}  // namespace slabstream::mip
