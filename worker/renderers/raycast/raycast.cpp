// The ray caster's pixel half (Levoy 1988 and 1990; as a part of a sort-last renderer, Ma et al. 1993). docs/rendering.md defines what it
// computes.
//
//   1. once a padded box: pad its voxels (RayVolume) and find the range of each small cell
//   2. once a transfer function, looks of labels and fields, and octant of directions: for each cell, find how far rays may leap
//   (EmptyDistances)
//   3. once a frame: tiles of pixels are separate tasks; a tile's rays march through the box (March)

#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "common/parallel/per_thread.h"
#include "common/renderers/raycast/raycast_parameters.h"
#include "worker/rays/render_pieces.h"
#include "worker/renderers/raycast/empty_distance.h"
#include "worker/renderers/raycast/field_cells.h"
#include "worker/renderers/raycast/frame_fields.h"
#include "worker/renderers/raycast/march.h"
#include "worker/renderers/raycast/march_stretched.h"
#include "worker/renderers/raycast/surface_cells.h"
#include "worker/renderers/renderer.h"
#include "worker/renderers/stage_clock.h"

namespace slabstream::raycast {
namespace {

// Of one piece of a padded box.
struct Visibility {
  EmptyDistances to_samples;
  std::optional<EmptyDistances> to_surfaces;  // none: no isosurface is shown
  std::vector<std::int32_t> surface_cells;    // FindSurfaceCells
  SampledRegion region;                       // positions in visible cells; empty if low.x > high.x
  std::vector<std::uint16_t> shown;           // RayFields::shown; empty: there are no other fields
};

// What is visible of a padded box: samples of the volume, and what labels and other fields add.
struct VisibleValues {
  VisibleSamples volume;
  // Labels that are material.
  struct Labels {
    MatterNumbers matter;
    std::weak_ptr<std::byte[]> voxels;  // their numbers
    AffineMap map;
    bool smooth;
    friend bool operator==(const Labels& a, const Labels& b) {
      return a.matter == b.matter && a.smooth == b.smooth && !a.voxels.owner_before(b.voxels) && !b.voxels.owner_before(a.voxels) &&
             a.map == b.map;
    }
  };
  std::optional<Labels> labels = {};
  FrameFields::Visible fields = {};
  friend bool operator==(const VisibleValues&, const VisibleValues&) = default;
};

// `labels`: null: none are shown.
Visibility VisibilityOf(const RayPiece& piece, const VisibleValues& visible, const RayLabels* labels, const FrameFields& fields) {
  const bool has_surfaces = !visible.volume.isovalues().empty();
  const Index3& counts = piece.cells.counts;
  std::vector<std::uint8_t> with_samples =
      VisibleCells(piece.cells, [&](float low, float high) { return visible.volume.AnyMatterBetween(low, high); });
  if (visible.labels) {
    std::vector<std::uint8_t> cells =
        VisibleCells(labels->numbers->cells, [&](float low, float high) { return labels->matter.AnyBetween(low, high); });
    if (visible.labels->smooth) SpreadToNeighbours(labels->numbers->cells.counts, cells);
    const std::vector<std::uint8_t> in_cells = CellsThatShow(piece, *labels->numbers, labels->map, cells);
    for (std::size_t i = 0; i < in_cells.size(); ++i) {
      if (in_cells[i] != 0) with_samples[i] = 0;
    }
  }
  std::vector<std::uint16_t> shown;
  if (!fields.empty()) {
    shown = fields.ShownIn(piece);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      if (with_samples[i] == 0) shown[i] |= RayFields::kVolume;
      if (shown[i] != 0) with_samples[i] = 0;
    }
    shown.push_back(0);  // kernels read two bytes more
  }
  std::vector<std::int32_t> surface_cells;
  std::vector<std::uint8_t> with_surfaces;
  if (has_surfaces) {
    surface_cells = FindSurfaceCells(piece.voxels, piece.cells, visible.volume);
    with_surfaces = MacrocellsWithSurfaces(surface_cells);
  }
  Box cells;
  std::size_t number = 0;
  for (Index3 cell; cell.z < counts.z; ++cell.z) {
    for (cell.y = 0; cell.y < counts.y; ++cell.y) {
      for (cell.x = 0; cell.x < counts.x; ++cell.x, ++number) {
        if (with_samples[number] != 0 && (!has_surfaces || with_surfaces[number] != 0)) continue;
        cells = Hull(cells, {cell, {cell.x + 1, cell.y + 1, cell.z + 1}});
      }
    }
  }
  Visibility result{
      EmptyDistances(counts, std::move(with_samples)), std::nullopt, std::move(surface_cells), {{1, 0, 0}, {0, 0, 0}}, std::move(shown)};
  if (has_surfaces) result.to_surfaces.emplace(counts, std::move(with_surfaces));
  if (cells.empty()) return result;
  const Vec3 origin = ToVec3(piece.voxels.box.begin) - Vec3{1, 1, 1};
  result.region = {origin + double(kCellSide) * ToVec3(cells.begin), origin + double(kCellSide) * ToVec3(cells.end)};
  return result;
}

// The visible parts of a padded box, kept until other values are visible.
class VisibilityCache : public BoxCache {
 public:
  // By piece.
  const std::vector<Visibility>& Of(const std::vector<RayPiece>& pieces, const RayLook& look, const RayLabels* labels,
                                    const FrameFields& fields, OctantSet octants) {
    VisibleValues visible{.volume = VisibleSamples(look), .fields = fields.visible()};
    if (labels != nullptr && labels->tables.surface) {
      visible.labels = {labels->matter, labels->numbers->voxels.samples, labels->map, labels->tables.smooth};
    }
    if (pieces_.empty() || visible_ != visible) {
      visible_ = std::move(visible);
      pieces_.clear();
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        pieces_.push_back(VisibilityOf(pieces[i], *visible_, labels, fields));
      }
      has_eighths_ = visible_->labels || !fields.empty();  // those are of the volume alone
    } else if (!has_eighths_) {                            // they pay only where several frames show the same
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        EmptyDistances& to_samples = pieces_[i].to_samples;
        to_samples.SetEighths(VisibleEighths(pieces[i].voxels, pieces[i].cells.counts, to_samples.visible(),
                                             [&](float low, float high) { return visible.volume.AnyMatterBetween(low, high); }));
      }
      has_eighths_ = true;
    }
    for (Visibility& piece : pieces_) {
      piece.to_samples.Find(octants);
      if (piece.to_surfaces) piece.to_surfaces->Find(octants);
    }
    return pieces_;
  }

  std::size_t bytes() const override {
    std::size_t total = 0;
    for (const Visibility& piece : pieces_) {
      total += piece.to_samples.bytes() + (piece.to_surfaces ? piece.to_surfaces->bytes() : 0);
      total += piece.surface_cells.capacity() * sizeof(piece.surface_cells[0]) + piece.shown.capacity() * sizeof(piece.shown[0]);
    }
    return total;
  }

 private:
  std::optional<VisibleValues> visible_;
  std::vector<Visibility> pieces_;
  bool has_eighths_ = false;
};

// The table of the transfer function's regions, kept until another one is asked for.
class RegionCache : public BoxCache {
 public:
  // Null: it has none. With extinctions of a step in place of opacities in a rectilinear grid, as of MakeExtinctions.
  const RegionTable* Of(const FrameSetup& setup, const ClassificationTable& classification, const RayLook& look) {
    const TransferFunction& transfer = setup.transfer;
    if (transfer.regions.empty()) return nullptr;
    Key key = {transfer.regions, transfer.isosurfaces,      transfer.gradient_opacities,
               setup.range,      setup.description.mapping, look.step_exponent};
    if (key != key_) {
      table_ = MakeRegionTable(transfer, classification, setup.description.mapping);
      const bool stretched = setup.description.geometry.rectilinear();
      table_.ReplaceOpacities([&](double opacity) {
        const double log = double(look.step_exponent) * std::log1p(-opacity);
        return stretched ? std::min(-log, kOpaqueExtinction) : -std::expm1(log);
      });
      key_ = std::move(key);
    }
    return &table_;
  }

  std::size_t bytes() const override { return table_.entries.capacity() * sizeof(float); }

 private:
  using Key = std::tuple<std::vector<TransferRegion>, std::vector<Isosurface>, std::vector<GradientOpacityPoint>, ValueRange, ValueMapping,
                         float>;  // all that the classification and the table are made from
  std::optional<Key> key_;
  RegionTable table_;
};

// The region, in voxels of the level, and where shapes may lie.
SampledRegion WithShapes(SampledRegion region, const FrameSetup& setup, std::uint8_t level) {
  const GridMap map = MapTo(setup, level);
  const Stretch& stretch = setup.description.geometry.stretch;
  for (const ShapeSetup& shape : setup.shapes) {
    const bool empty = region.low.x > region.high.x;
    for (const Axis axis : kAxes) {
      const double low = map.To(stretch.ToVoxel(shape.low[axis], axis), axis), high = map.To(stretch.ToVoxel(shape.high[axis], axis), axis);
      region.low[axis] = empty ? low : std::min(region.low[axis], low);
      region.high[axis] = empty ? high : std::max(region.high[axis], high);
    }
  }
  return region;
}

class RaycastRenderer : public Renderer {
 public:
  Result<LocalImage> Render(BoxData& data, const LevelBox& at, const FrameSetup& setup, const OcclusionMask& hidden,
                            const RenderControl& control, RankReport& report) override {
    StageClock clock(report);
    const double samples_per_voxel = setup.parameters.at(0);
    const VolumeGeometry& geometry = setup.description.geometry;
    std::optional<StretchedSteps> stretched;
    if (geometry.rectilinear()) stretched.emplace(setup, samples_per_voxel);
    const std::vector<RayPiece>& pieces = data.CacheOf<RayVolume>().PiecesOf(data);
    const ClassificationTable& classification = data.Classification(setup);
    const double steps_per_voxel = stretched ? StretchedSteps::StepsPerVoxel(geometry, samples_per_voxel) : samples_per_voxel;
    RayLook look = MakeRayLook(classification, setup.transfer, setup.description, setup.camera, setup.shading,
                               steps_per_voxel / setup.weight, GeometryOf(setup, at.level).spacing);
    if (stretched) MakeExtinctions(look);
    look.regions = data.CacheOf<RegionCache>().Of(setup, classification, look);
    const Result<std::optional<RayLabels>> labels = LabelsFor(data, at, setup, samples_per_voxel);
    if (!labels.ok()) return labels.status();
    const RayLabels* const shown_labels = *labels ? &**labels : nullptr;
    const Result<FrameFields> fields = FrameFields::Make(data, at, setup, samples_per_voxel);
    if (!fields.ok()) return fields.status();
    const ViewRays rays = stretched ? stretched->rays
                                    : Jittered(MakeViewRays(setup.camera, geometry, samples_per_voxel, setup.clip), setup.camera,
                                               setup.clip, setup.parameters.at(kJitter));
    const std::vector<Visibility>& visible = data.CacheOf<VisibilityCache>().Of(pieces, look, shown_labels, *fields, OctantsOf(rays));
    clock.Charge(Stage::kPrepare);

    std::optional<FrameLight::View> light;
    if (data.light() != nullptr) light = data.light()->Seen(MapTo(setup, at.level));
    const FragmentOrder order(setup);
    const RayEnds ends(setup.termination);
    std::atomic<std::uint64_t> shaded = 0;
    std::vector<std::vector<RayField>> fields_of_pieces;
    for (const RayPiece& piece : pieces) fields_of_pieces.push_back(fields->Of(piece, look));
    PerThread<std::vector<GradientBricks>> bricks;
    LocalImage image = RenderPieces(
        pieces, {at, setup, rays, hidden, control, report, stretched ? &stretched->tables : nullptr},
        [&](std::size_t piece) { return WithShapes(visible[piece].region, setup, at.level); },
        [&](std::size_t piece, const RayBox& ray_box, const PixelBounds& tile, std::uint8_t steps, float* rgba, std::size_t floats_a_row) {
          const RayFields ray_fields = {fields_of_pieces[piece], visible[piece].shown.data(), setup.flat};
          const MarchWork work = {.rays = &rays,
                                  .box = &ray_box,
                                  .look = &look,
                                  .to_samples = &visible[piece].to_samples,
                                  .to_surfaces = visible[piece].to_surfaces ? &*visible[piece].to_surfaces : nullptr,
                                  .surface_cells = visible[piece].surface_cells.data(),
                                  .termination = ends[steps],
                                  .smooth = SmoothGradient(setup.parameters),
                                  .labels = shown_labels,
                                  .fields = fields->empty() ? nullptr : &ray_fields,
                                  .shapes = TileOf(data.shapes(), tile),
                                  .order = &order,
                                  .light = light ? &*light : nullptr};
          if (stretched) {
            shaded += MarchStretchedTile(work, *stretched, tile, rgba, floats_a_row);
            return;
          }
          std::vector<GradientBricks>& of_thread = bricks.Mine([&] { return std::vector<GradientBricks>(ray_fields.fields.size()); });
          shaded += MarchTile(work, tile, of_thread, rgba, floats_a_row);
        });
    report.drawn_voxels += std::uint64_t(std::ceil(double(shaded) * VoxelsASample(rays, setup.camera, geometry)));
    return clock.Finish(std::move(image), control);
  }
};

}  // namespace

std::unique_ptr<Renderer> MakePixelHalf() { return std::make_unique<RaycastRenderer>(); }

}  // namespace slabstream::raycast
