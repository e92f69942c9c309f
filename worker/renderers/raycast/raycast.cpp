// The ray caster's pixel half (Levoy 1988 and 1990; as a part of a sort-last renderer, Ma et al. 1993). docs/rendering.md defines what it
// computes.
//
//   1. once a slab: pad its voxels (RayVolume) and find the range of each small cell
//   2. once a transfer function: for each cell, find the distance to the nearest visible one (EmptyDistances)
//   3. once a frame: tiles of pixels are separate tasks; a tile's rays march through the box (March)
#include <cmath>
#include <optional>
#include <utility>

#include "common/kernels/combine.h"
#include "worker/rays/ray_volume.h"
#include "worker/rays/render_tiles.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/march.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::raycast {
namespace {

// Of one piece of a slab.
struct Visibility {
  std::vector<std::uint8_t> distances;
  SampledRegion region;  // positions in visible cells; empty if low.x > high.x
};

Visibility VisibilityOf(const RayPiece& piece, const VisibleSamples& visible) {
  Visibility result{EmptyDistances(piece.cells, visible), {{1, 0, 0}, {0, 0, 0}}};
  const Index3& counts = piece.cells.counts;
  Box cells;
  std::size_t number = 0;
  for (Index3 cell; cell.z < counts.z; ++cell.z) {
    for (cell.y = 0; cell.y < counts.y; ++cell.y) {
      for (cell.x = 0; cell.x < counts.x; ++cell.x, ++number) {
        if (result.distances[number] != 0) continue;
        cells = Hull(cells, {cell, {cell.x + 1, cell.y + 1, cell.z + 1}});
      }
    }
  }
  if (cells.empty()) return result;
  const Vec3 origin = ToVec3(piece.voxels.box.begin) - Vec3{1, 1, 1};
  result.region = {origin + double(kCellSide) * ToVec3(cells.begin), origin + double(kCellSide) * ToVec3(cells.end)};
  return result;
}

// The visible parts of a slab, kept until the transfer function makes other samples visible.
class VisibilityCache : public SlabCache {
 public:
  // By piece.
  const std::vector<Visibility>& Of(const std::vector<RayPiece>& pieces, const RayLook& look) {
    VisibleSamples visible(look);
    if (pieces_.empty() || visible_ != visible) {
      visible_ = std::move(visible);
      pieces_.clear();
      for (const RayPiece& piece : pieces) pieces_.push_back(VisibilityOf(piece, *visible_));
    }
    return pieces_;
  }

  std::size_t bytes() const override {
    std::size_t total = 0;
    for (const Visibility& piece : pieces_) total += piece.distances.capacity();
    return total;
  }

 private:
  std::optional<VisibleSamples> visible_;
  std::vector<Visibility> pieces_;
};

// The share of a voxel's volume that a sample at the volume's centre represents: a pixel's area times a step.
double VoxelsASample(const ViewRays& rays, const FrameSetup& setup) {
  const VolumeGeometry& geometry = setup.description.geometry;
  const double depth = rays.perspective ? setup.camera.Project(0.5 * (ToVec3(geometry.size) - Vec3{1, 1, 1})).depth : 1;
  const double voxel = geometry.spacing.x * geometry.spacing.y * geometry.spacing.z;
  return double(rays.pixel_squared) * depth * depth * double(rays.step) / voxel;
}

class RaycastRenderer : public Renderer {
 public:
  Result<LocalImage> Render(SlabData& slab, const Box& box, const FrameSetup& setup, const OcclusionMask& hidden,
                            const std::atomic<bool>& cancelled, RankReport& report) override {
    StageClock clock(report);
    const double samples_per_voxel = setup.parameters.at(0);
    const std::vector<RayPiece>& pieces = slab.CacheOf<RayVolume>().PiecesOf(slab);
    const RayLook look =
        MakeRayLook(slab.Classification(setup), setup.transfer, setup.description, setup.camera, setup.shading, samples_per_voxel);
    const std::vector<Visibility>& visible = slab.CacheOf<VisibilityCache>().Of(pieces, look);
    clock.Charge(Stage::kPrepare);

    const ViewRays rays = MakeViewRays(setup.camera, setup.description.geometry, samples_per_voxel, setup.clip);
    LocalImage image = MakeLocalImage(setup.format, {});
    std::atomic<std::uint64_t> shaded = 0;
    for (const std::size_t number : NearestFirst(pieces, setup.camera)) {
      const RayPiece& piece = pieces[number];
      const Box part = Intersection(box, piece.voxels.box);
      if (part.empty()) continue;
      const RayBox ray_box = MakeRayBox(piece.voxels, piece.cells.counts, part, visible[number].region, rays, setup.camera);
      const MarchWork work = {&rays, &ray_box, &look, visible[number].distances.data(), float(setup.termination)};
      LocalImage layer = MakeLocalImage(setup.format, ray_box.reach.pixels);
      RenderTiles(layer, hidden, cancelled, report, [&](const PixelBounds& tile, float* rgba, std::size_t floats_a_row) {
        shaded += MarchTile(work, tile, rgba, floats_a_row);
      });
      if (image.bounds.empty()) {
        image = std::move(layer);
      } else {
        Combine(image, layer, Side::kBack);
      }
    }
    report.drawn_voxels += std::uint64_t(std::ceil(double(shaded) * VoxelsASample(rays, setup)));
    clock.Finish(Stage::kRender);
    if (cancelled) return Status::Cancelled("rendering was cancelled");
    return image;
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<RaycastRenderer>(); }

}  // namespace slabstream::raycast
