// The pixel half of slicing (Yagel, Reed, Law, Shih, Shareef 1996). docs/rendering.md defines what it computes.
//
//   1. once a transfer function: find the cells of which anything may be visible (ShownCells)
//   2. once a frame: move the cells' points to frame space (FrameSpace), and find the cells of each tile of the picture (CellBins)
//   3. tiles are separate tasks (SliceTile)

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "common/mesh/mesh_cell.h"
#include "common/parallel/parallel.h"
#include "common/parallel/per_thread.h"
#include "common/volume/summary.h"
#include "worker/rays/ray_box.h"
#include "worker/rays/render_tiles.h"
#include "worker/renderers/box_data.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/slice/slice_tile.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::slice {
namespace {

// The tetrahedra of a padded box of which anything may be visible. Kept until other values are visible.
class ShownCells : public BoxCache {
 public:
  // Numbers of tetrahedra, ascending. Those with a value that is not finite are not among them. `mesh` is the padded box's. Parallel.
  std::span<const std::uint32_t> Of(const Mesh& mesh, const VisibleSamples& visible);

  std::size_t bytes() const override { return ranges_.capacity() * sizeof(ranges_[0]) + shown_.capacity() * sizeof(shown_[0]); }

 private:
  std::vector<ValueRange> ranges_;  // by tetrahedron: ValuesIn
  std::optional<VisibleSamples> visible_;
  std::vector<std::uint32_t> shown_;
};

std::span<const std::uint32_t> ShownCells::Of(const Mesh& mesh, const VisibleSamples& visible) {
  if (visible_ == visible) return shown_;
  const std::size_t count = mesh.tetrahedra.size();
  constexpr std::size_t kBlock = 1 << 15;
  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  const auto for_each_block = [&](auto&& work) {
    ParallelFor(0, blocks, [&](std::size_t block) { work(block, block * kBlock, std::min((block + 1) * kBlock, count)); });
  };

  if (ranges_.size() != count) {
    ranges_.resize(count);
    for_each_block([&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ranges_[i] = ValuesIn(mesh, i);
    });
  }

  // Each block's cells are counted, then written behind those of the blocks before it.
  std::vector<std::size_t> first(blocks + 1, 0);
  const auto shows = [&](std::size_t i) { return visible.AnyBetween(ranges_[i].min, ranges_[i].max); };
  for_each_block([&](std::size_t block, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) first[block + 1] += shows(i) ? 1 : 0;
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  shown_.resize(first.back());
  for_each_block([&](std::size_t block, std::size_t begin, std::size_t end) {
    std::size_t at = first[block];
    for (std::size_t i = begin; i < end; ++i) {
      if (shows(i)) shown_[at++] = std::uint32_t(i);
    }
  });
  visible_ = visible;
  return shown_;
}

// The samples of the box, and pixels of the frame that they may lie in.
RayReach SetBox(const Box& box, SliceWork& work) {
  const auto& [low, high] = WholeBox(box);
  for (const Axis axis : kAxes) {
    const auto i = std::size_t(Number(axis));
    work.low[i] = float(low[axis]);
    work.high[i] = float(high[axis]);
    work.at_border = work.at_border || box.begin[axis] == 0 || work.high[i] >= work.space->rays().volume_end[i];
  }
  const RayReach reach = work.space->ReachOf(low, high);
  work.k_begin = reach.begin;
  work.k_end = reach.end;
  return reach;
}

class SliceRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    const Box& box = at.box;
    if (data.cells() == nullptr) {
      return Status::InvalidArgument("renderer slice draws the cells of unstructured grids, but the dataset has none");
    }
    StageClock clock(report);
    const Mesh& mesh = *data.cells();
    const double planes_per_voxel = setup.parameters.at(0);
    const VolumeGeometry& geometry = setup.description.geometry;
    ClassificationTable table = data.Classification(setup);
    table.stored_extent = 1;  // meshes have gradients of their own scale (point_gradients.h)
    const RayLook look = MakeRayLook(table, setup.transfer, setup.description, setup.camera, setup.shading, planes_per_voxel);
    const std::span<const std::uint32_t> shown = data.CacheOf<ShownCells>().Of(mesh, VisibleSamples(look));
    clock.Charge(Stage::kPrepare);
    if (shown.empty() && data.shapes() == nullptr) return clock.Finish(MakeLocalImage(setup.format, {}), control);

    const FrameSpace space(setup.camera, geometry, planes_per_voxel, setup.clip);
    SliceWork work = {.space = &space, .mesh = &mesh, .look = &look, .termination = float(setup.termination)};
    std::optional<FrameLight::View> light;
    if (data.light() != nullptr) work.light = &light.emplace(data.light()->Seen());
    const RayReach reach = SetBox(box, work);
    std::optional<BoxFragments> fragments;
    if (data.shapes() != nullptr) {
      work.fragments = &fragments.emplace(BoxFragments{*data.shapes(), space.rays(), FragmentOrder(setup), work.low, work.high});
    }
    FramePoints& points = data.CacheOf<FramePoints>();
    space.Place(mesh.points, points);
    work.points = &points;
    const Result<CellBins> bins = CellBins::Make(points.bounds, mesh.tetrahedra, shown, reach.pixels, reach.begin, reach.end,
                                                 [&](const PixelBounds& tile) { return hidden.HidesAll(tile); });
    if (!bins.ok()) return bins.status();
    clock.Charge(Stage::kTransform);

    LocalImage image = MakeLocalImage(setup.format, reach.pixels);
    const std::uint64_t drawn = RenderTiles(work, *bins, image, control, report);
    report.drawn_voxels += std::uint64_t(std::ceil(double(drawn) * VoxelsASample(space.rays(), setup.camera, geometry)));
    return clock.Finish(std::move(image), control);
  }

 private:
  // Returns how many samples were drawn.
  static std::uint64_t RenderTiles(const SliceWork& work, const CellBins& bins, LocalImage& image, const RenderControl& control,
                                   RankReport& report) {
    const auto width = std::size_t(image.bounds.width());
    std::atomic<std::uint64_t> drawn = 0;
    PerThread<TileRoomPtr> rooms;
    ForEachTile(bins.tiles(), control, report, [&](std::int32_t number) {
      const std::span<const CellBins::Entry> cells = bins.VoxelsOf(number);
      if (cells.empty() && work.fragments == nullptr) return;
      const PixelBounds tile = bins.TileAt(number);
      const std::size_t pixel = std::size_t(tile.y_begin - image.bounds.y_begin) * width + std::size_t(tile.x_begin - image.bounds.x_begin);
      drawn += SliceTile(work, tile, cells, *rooms.Mine(MakeTileRoom), &image.rgba[4 * pixel], 4 * width);
    });
    return drawn;
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<SliceRenderer>(); }

}  // namespace slabstream::slice
