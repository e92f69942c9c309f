// The pixel half of intensity projections: the largest, the least or the mean sample along each ray. docs/rendering.md defines them.
#include <array>
#include <utility>

#include "common/kernels/combine.h"
#include "common/renderers/mip/projection_mode.h"
#include "worker/rays/ray_volume.h"
#include "worker/rays/render_tiles.h"
#include "worker/renderers/mip/project.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::mip {
namespace {

// Bounds of a slab's cells, by piece.
class BoundsCache : public SlabCache {
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
  Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const OcclusionMask& hidden,
                            const std::atomic<bool>& cancelled, RankReport& report) override {
    StageClock clock(report);
    const ProjectionMode mode = ModeOf(setup);
    ProjectWork work;
    // If data values fall as stored samples rise, the largest value belongs to the least sample.
    const ValueMapping& mapping = setup.description.mapping;
    const bool largest = (mode == ProjectionMode::kMaximum) == (mapping.scale >= 0);
    work.sign = largest ? 1.0F : -1.0F;
    work.complement = mode == ProjectionMode::kMinimum;
    work.nearest = TakesNearestVoxel(setup);
    // value = (data value - range.min) / (range.max - range.min)
    const double range = double(setup.range.max) - double(setup.range.min);
    if (mapping.scale != 0 && range > 0) {
      work.low = float((double(setup.range.min) - mapping.offset) / mapping.scale);
      work.scale = float(mapping.scale / range);
    } else {
      work.scale = 0;
    }
    const std::vector<RayPiece>& pieces = slab.CacheOf<RayVolume>().PiecesOf(slab);
    const std::vector<SampleBounds>* const bounds =
        mode == ProjectionMode::kMean ? nullptr : &slab.CacheOf<BoundsCache>().Of(pieces, work.sign);
    clock.Charge(Stage::kPrepare);

    const ViewRays rays = MakeViewRays(setup.camera, setup.description.geometry, SamplesPerVoxel(setup), setup.clip);
    work.rays = &rays;
    LocalImage image = MakeLocalImage(setup.format, {});
    for (std::size_t number = 0; number < pieces.size(); ++number) {
      const RayPiece& piece = pieces[number];
      const Box part = Intersection(box, piece.voxels.box);
      if (part.empty()) continue;
      const RayBox ray_box = MakeRayBox(piece.voxels, piece.cells.counts, part, WholeBox(part), rays, setup.camera);
      work.box = &ray_box;
      work.bounds = bounds == nullptr ? nullptr : &(*bounds)[number];
      LocalImage layer = MakeLocalImage(setup.format, ray_box.reach.pixels);
      RenderTiles(layer, hidden, cancelled, report,
                  [&](const PixelBounds& tile, float* pixels, std::size_t floats_a_row) { ProjectTile(work, tile, pixels, floats_a_row); });
      if (image.bounds.empty()) {
        image = std::move(layer);
      } else {
        Combine(image, layer, Side::kBack);
      }
    }
    clock.Finish(Stage::kRender);
    if (cancelled) return Status::Cancelled("rendering was cancelled");
    return image;
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<MipRenderer>(); }

}  // namespace slabstream::mip
