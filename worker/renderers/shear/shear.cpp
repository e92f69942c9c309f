// The pixel half of multi-pass shears (Hanrahan 1990; the pipeline of Figure 4b in Yagel and Machiraju 1995). docs/rendering.md defines
// what it computes.
//
//   1. once a padded box: find the range of each small cube of voxels (VoxelRanges)
//   2. once an order of the axes: store the voxels so that beams of the first pass are contiguous (TurnedVoxels)
//   3. once a transfer function, too: find where anything can be visible (ActiveMacrocells)
//   4. once a frame: tiles of the picture are separate tasks (ShearTile)

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "common/parallel/per_thread.h"
#include "worker/rays/ray_box.h"
#include "worker/rays/render_tiles.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/shear/shear_tile.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::shear {
namespace {

using AxisOrder = std::array<Axis, 3>;

class ShearCache : public BoxCache {
 public:
  const TurnedVoxels& TurnedTo(const AxisOrder& axes, const BoxData& data) {
    if (turned_.samples == nullptr || turned_.axes != axes) {
      turned_ = {};  // first, so that there are never two
      turned_ = Turn(data.bricks(), axes);
    }
    return turned_;
  }

  const ActiveMacrocells& ActiveFor(const VisibleSamples& visible, const AxisOrder& axes, const BoxData& data) {
    if (!ranges_) ranges_ = FindVoxelRanges(data.bricks());
    if (!active_for_ || active_for_ != std::tuple(visible, axes)) {
      active_ = FindActiveMacrocells(*ranges_, visible, axes);
      active_for_.emplace(visible, axes);
    }
    return active_;
  }

  std::size_t bytes() const override {
    return turned_.bytes() + active_.active.capacity() + (ranges_ ? ranges_->ranges.capacity() * sizeof(MacrocellRange) : 0);
  }

 private:
  TurnedVoxels turned_;
  std::optional<VoxelRanges> ranges_;
  std::optional<std::tuple<VisibleSamples, AxisOrder>> active_for_;
  ActiveMacrocells active_;
};

ShearPasses PassesOf(const ViewRays& rays) {
  const auto vector = [](const Float3& v, double scale = 1) {
    return Vec3{scale * double(v[0]), scale * double(v[1]), scale * double(v[2])};
  };
  return MakeShearPasses(vector(rays.start), vector(rays.right), vector(rays.down), vector(rays.forward, double(rays.step)));
}

// Renders the tiles of an image.
std::uint64_t RenderTiles(const ShearWork& work, LocalImage& image, const RenderControl& control, RankReport& report) {
  const PixelBounds& bounds = image.bounds;
  if (bounds.empty()) return 0;
  const bool turned = work.passes->turned;
  const std::int32_t u_begin = turned ? bounds.y_begin : bounds.x_begin, u_end = turned ? bounds.y_end : bounds.x_end;
  const std::int32_t v_begin = turned ? bounds.x_begin : bounds.y_begin, v_end = turned ? bounds.x_end : bounds.y_end;
  const std::ptrdiff_t column = 4, row = 4 * std::ptrdiff_t{bounds.width()};
  const std::int32_t across = (u_end - u_begin - 1) / kTileColumns + 1, down = (v_end - v_begin - 1) / kTileRows + 1;
  std::atomic<std::uint64_t> shaded = 0;
  PerThread<TileRoomPtr> rooms;
  ForEachTile(across * down, control, report, [&](std::int32_t number) {
    TilePixels tile;
    tile.u_begin = u_begin + number % across * kTileColumns;
    tile.v_begin = v_begin + number / across * kTileRows;
    tile.u_end = std::min(tile.u_begin + kTileColumns, u_end);
    tile.v_end = std::min(tile.v_begin + kTileRows, v_end);
    tile.along_u = turned ? row : column;
    tile.along_v = turned ? column : row;
    tile.first = image.rgba.data() + (tile.u_begin - u_begin) * tile.along_u + (tile.v_begin - v_begin) * tile.along_v;
    tile.pixels = turned ? PixelBounds{tile.v_begin, tile.u_begin, tile.v_end, tile.u_end}
                         : PixelBounds{tile.u_begin, tile.v_begin, tile.u_end, tile.v_end};
    if (!work.hidden->HidesAll(tile.pixels)) shaded += ShearTile(work, tile, *rooms.Mine(MakeTileRoom));
  });
  return shaded;
}

class ShearRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    const Box& box = at.box;
    StageClock clock(report);
    const double samples_per_voxel = setup.parameters.at(0);
    const VolumeGeometry& geometry = setup.description.geometry;
    const ViewRays rays = MakeViewRays(setup.camera, geometry, samples_per_voxel, setup.clip);
    const ShearPasses passes = PassesOf(rays);
    const RayLook look =
        MakeRayLook(data.Classification(setup), setup.transfer, setup.description, setup.camera, setup.shading, samples_per_voxel);
    const VisibleSamples visible(look);
    ShearCache& cache = data.CacheOf<ShearCache>();
    ShearWork work = {.rays = &rays,
                      .passes = &passes,
                      .kernel = MakeCubicKernel(Kernel(int(setup.parameters.at(kKernel)))),
                      .supersampling = SupersamplingOf(setup.parameters),
                      .voxels = &cache.TurnedTo(passes.axes, data),
                      .active = &cache.ActiveFor(visible, passes.axes, data),
                      .look = &look,
                      .visible = &visible,
                      .hidden = &hidden,
                      .termination = float(setup.termination)};
    clock.Charge(Stage::kPrepare);

    const SampledRegion owned = WholeBox(box);
    work.low = ToFloat3(owned.low);
    work.high = ToFloat3(owned.high);
    const Box active = Intersection(box, work.active->hull);
    RayReach reach;
    if (!active.empty()) reach = ReachOfBox(rays, setup.camera, WholeBox(active).low, WholeBox(active).high);
    work.k_begin = reach.begin;
    work.k_end = reach.end;
    std::optional<BoxFragments> fragments;
    if (const FrameShapes* const shapes = data.shapes()) {
      work.fragments = &fragments.emplace(BoxFragments{*shapes, rays, FragmentOrder(setup), work.low, work.high});
      const PixelBounds of_box = ReachOfBox(rays, setup.camera, owned.low, owned.high).pixels;
      reach.pixels = Union(reach.pixels, Intersection(of_box, shapes->bounds()));
    }
    LocalImage image = MakeLocalImage(setup.format, reach.pixels);
    const std::uint64_t shaded = RenderTiles(work, image, control, report);

    report.drawn_voxels += std::uint64_t(std::ceil(double(shaded) * VoxelsASample(rays, setup.camera, geometry)));
    return clock.Finish(std::move(image), control);
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<ShearRenderer>(); }

}  // namespace slabstream::shear
