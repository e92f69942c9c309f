#include "common/planning/levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/planning/picture_extent.h"
#include "common/planning/resolved_request.h"
#include "common/renderers/renderer_kind.h"
#include "common/view/default_view.h"
#include "common/view/world_limits.h"
#include "common/volume/grid_map.h"
#include "common/volume/indices.h"
#include "common/volume/light_volume.h"

namespace slabstream {
namespace {

// Greatest distance of neighbouring voxels along an axis where they are farther apart than in the finest level; 0: there is none.
double CoarseSpacing(const VolumeGeometry& finest, const VolumeGeometry& level) {
  constexpr double kSame = 1.01;
  double spacing = 0;
  for (const Axis axis : kAxes) {
    if (level.spacing[axis] > kSame * finest.spacing[axis]) spacing = std::max(spacing, level.spacing[axis]);
  }
  return spacing;
}

// The coarsest of the first `count` levels whose coarse voxels are at most so wide.
int CoarsestFor(double width, const VolumeLevels& levels, int count) {
  const VolumeGeometry& finest = levels.levels.front().geometry;
  int level = 0;
  for (int next = 1; next < count && CoarseSpacing(finest, levels.levels[std::size_t(next)].geometry) <= width; ++next) level = next;
  return level;
}

// Of the pixels that show the nearest point, in the camera's unit; orthographic: of all pixels.
double WidthAt(const Camera::ImageExtent& extent, const Camera& camera) {
  const bool perspective = camera.projection == Projection::kPerspective;
  return camera.PixelSizeAt(perspective ? std::max(extent.nearest, 1e-6 * camera.target_depth) : camera.target_depth);
}

// A map without levels yet: at most so many zones along an axis, none of less than 32 voxels.
LevelMap ZonesOf(const Index3& size, int most = 16) {
  LevelMap map{.levels = {}};
  for (const Axis axis : kAxes) {
    map.side[axis] = std::max(32, std::int32_t(std::bit_ceil(std::uint32_t(size[axis] + most - 1) / std::uint32_t(most))));
    map.counts[axis] = (size[axis] - 1) / map.side[axis] + 1;
  }
  return map;
}

// Calls function(width of the pixels that show its nearest point) for each zone of `map`, over `grid`; 0: it is not in the picture.
template <class Function>
void VisitZones(const LevelMap& map, const VolumeGeometry& grid, const FrameSetup& setup, Function&& function) {
  const GridMap to_camera = MapBetween(grid, WorldGeometryOf(setup));
  for (const Index3& zone : IndicesIn(map.counts)) {
    const Box box = grid.InDataSpace(map.BoxOf(zone, grid.size));
    const Camera::ImageExtent extent = ExtentOf(box, to_camera, setup.camera);
    const bool shown =
        InPicture(extent, setup.camera) && setup.clip.MayKeep(CoveringVoxels(box, to_camera, setup.description.geometry.size));
    function(shown ? setup.unit * WidthAt(extent, setup.camera) : 0);
  }
}

// The width of the least pixel that shows something of the volume; 0: none does.
double LeastWidth(const VolumeGeometry& grid, const FrameSetup& setup) {
  double least = 0;
  VisitZones(ZonesOf(grid.size), grid, setup, [&](double width) {
    if (width > 0) least = least == 0 ? width : std::min(least, width);
  });
  return least;
}

// Zones that touch at a side are of levels next to each other: the coarser one gives way.
void Even(LevelMap& map) {
  for (bool changed = true; std::exchange(changed, false);) {
    for (const Index3& zone : IndicesIn(map.counts)) {
      std::uint8_t& level = map.of_zone[NumberIn(map.counts, zone)];
      if (level == LevelMap::kOutside) continue;
      for (const Axis axis : kAxes) {
        for (const int step : {-1, 1}) {
          Index3 beside = zone;
          beside[axis] += step;
          if (beside[axis] < 0 || beside[axis] == map.counts[axis] || level <= map.Of(beside) + 1) continue;
          level = std::uint8_t(map.Of(beside) + 1);
          changed = true;
        }
      }
    }
  }
}

// By zone: the finest of the levels of `map` that has voxels of its own there, or beside one of its faces, where they count for what is
// interpolated.
std::vector<std::uint8_t> RefinedIn(const LevelMap& map, const VolumeLevels& levels) {
  std::vector<std::uint8_t> finest(CountIn(map.counts), std::uint8_t(map.levels.size() - 1));
  const VolumeGeometry& grid = levels.levels[std::size_t(map.levels.front())].geometry;
  for (std::size_t n = map.levels.size(); n-- > 0;) {
    const auto level = std::size_t(map.levels[n]);
    const VolumeGeometry& geometry = levels.levels[level].geometry;
    const std::vector<Box> everywhere = {geometry.bounds()};
    const GridMap to_grid = MapBetween(geometry, grid);
    for (const Box& box : levels.refined[level] != nullptr ? *levels.refined[level] : everywhere) {
      // Beside a face, half of what a picture shows at the border of a zone is the refined cell's; beside an edge, a quarter or less.
      for (const Axis axis : kAxes) {
        Index3 step;
        step[axis] = 1;
        const Box there = CoveringVoxels(Intersection({box.begin - step, box.end + step}, geometry.bounds()), to_grid, grid.size);
        for (const Index3& zone : IndicesIn({there.begin / map.side, (there.end - Uniform(1)) / map.side + Uniform(1)})) {
          finest[NumberIn(map.counts, zone)] = std::uint8_t(n);
        }
      }
    }
  }
  return finest;
}

// The map of a picture whose finest level is `first`. `all`: also of what the picture does not show; its pixels are as wide everywhere.
LevelMap MapOf(double detail, const VolumeLevels& levels, int first, const FrameSetup& setup, bool all = false) {
  constexpr int kMostOfMesh = 32;
  const VolumeDescription& grid = levels.levels[std::size_t(first)];
  LevelMap map = levels.refined.empty() ? ZonesOf(grid.geometry.size) : ZonesOf(grid.geometry.size, kMostOfMesh);
  int end = first;
  const auto fits = [&](const VolumeDescription& level) {
    return level.type == grid.type && level.mapping == grid.mapping && CanStandIn(level.geometry, grid.geometry);
  };
  for (; end < int(levels.levels.size()) && fits(levels.levels[std::size_t(end)]); ++end) map.levels.push_back(end);
  const double everywhere = all ? setup.unit * WidthAt({}, setup.camera) : 0;
  VisitZones(map, grid.geometry, setup, [&](double shown) {
    const double width = shown > 0 ? shown : everywhere;
    const int level = CoarsestFor(detail * width, levels, end);
    map.of_zone.push_back(width > 0 ? std::uint8_t(std::max(level - first, 0)) : LevelMap::kOutside);
  });
  if (!levels.refined.empty()) {
    const std::vector<std::uint8_t> refined = RefinedIn(map, levels);
    for (std::size_t i = 0; i < refined.size(); ++i) map.of_zone[i] = std::max(map.of_zone[i], refined[i]);
  }
  Even(map);
  return map;
}

// Only levels that a zone is drawn from.
LevelMap WithoutUnused(LevelMap map) {
  std::vector<std::uint8_t> number(map.levels.size(), LevelMap::kOutside);  // by present number
  for (const std::uint8_t level : map.of_zone) {
    if (level != LevelMap::kOutside) number[level] = 0;
  }
  std::vector<int> used;
  for (std::size_t level = 0; level < number.size(); ++level) {
    if (number[level] == LevelMap::kOutside) continue;
    number[level] = std::uint8_t(used.size());
    used.push_back(map.levels[level]);
  }
  map.levels = std::move(used);
  if (map.levels.size() == 1) return {.levels = map.levels};
  for (std::uint8_t& level : map.of_zone) {
    if (level != LevelMap::kOutside) level = number[level];
  }
  return map;
}

// The frame drawn from the overview, without light: it changes no level, and here there is no level to make a light volume from.
Result<FrameSetup> SetupOfOverview(const FrameRequest& request, const VolumeGeometry& finest,
                                   const std::shared_ptr<const VolumeSummary>& overview, const ShownFields& fields) {
  Result<ResolvedRequest> resolved = ResolveRequest(AtLevel(request, finest, overview->description.geometry), 1, overview, fields);
  if (!resolved.ok()) return resolved.status();
  resolved->frame.shading = {};
  return MakeFrameSetup(*resolved);
}

void MoveBox(ClipBox& box, const VolumeGeometry& finest, const VolumeGeometry& level) {
  if (box.unit == ClipUnit::kWorld) return;
  const GridMap map = MapBetween(finest, level);
  for (const Axis axis : kAxes) {
    for (double* const bound : {&box.low[axis], &box.high[axis]}) {
      if (std::abs(*bound) == kMaxCoordinate) continue;
      const double voxels = box.unit == ClipUnit::kPercent ? *bound / 100 * finest.size[axis] : *bound;
      *bound = map.To(voxels - 0.5, axis) + 0.5;
    }
  }
  box.unit = ClipUnit::kVoxels;
}

void MoveSlab(ClipSlab& slab, const VolumeGeometry& finest) {
  slab.through = MiddleOf(slab, finest);
  slab.index.reset();
}

}  // namespace

VolumeSummary StatisticsOf(const VolumeLevels& levels) {
  VolumeSummary summary;
  summary.description = levels.levels.front();
  summary.range = levels.overview->range;
  summary.histogram = levels.overview->histogram;
  summary.non_finite = levels.overview->non_finite;
  return summary;
}

LevelMap NoneLarger(LevelMap map, std::int64_t bytes, const VolumeLevels& levels) {
  const auto fits = [&](int level) { return levels.levels[std::size_t(level)].voxel_bytes() <= bytes; };
  if (std::ranges::all_of(map.levels, fits)) return map;
  int level = 0;
  while (level + 1 < int(levels.levels.size()) && !fits(level)) ++level;
  return {.levels = {std::max(level, map.levels.front())}};
}

int LightLevelOf(const VolumeLevels& levels) {
  const int last = int(levels.levels.size()) - 1;
  for (int level = 0; level < last; ++level) {
    if (IsLightSized(levels.levels[std::size_t(level)].geometry)) return level;
  }
  return last;
}

Result<LevelMap> LevelsOf(const FrameRequest& request, const VolumeLevels& levels, const ShownFields& fields) {
  const int count = int(levels.levels.size());
  const VolumeGeometry& finest = levels.levels.front().geometry;
  // Coarser levels have other indices.
  if (Status status = CheckSlices(request, finest); !status.ok()) return status;
  if (const std::optional<int> level = LevelNumber(request.level)) {
    if (*level < count) return LevelMap{.levels = {*level}};
    return Status::InvalidArgument(fmt::format("level is {}, but dataset \"{}\" has levels 0 to {}", *level, request.dataset, count - 1));
  }
  const Result<FrameSetup> setup = SetupOfOverview(request, finest, levels.overview, fields);
  if (!setup.ok()) return setup.status();
  const VolumeGeometry& overview = levels.overview->description.geometry;
  const Camera& camera = setup->camera;
  const double detail = request.detail == 0 ? 1 : request.detail;
  const auto whole = [&] {
    const double width = setup->unit * WidthAt(ExtentOf(overview.bounds(), {}, camera), camera);
    return LevelMap{.levels = {CoarsestFor(detail * width, levels, count)}};
  };
  const bool mixes = !levels.owned && (camera.projection == Projection::kPerspective || !levels.refined.empty()) &&
                     setup->renderer->Can(Ability::kLevels) && setup->transfer.isosurfaces.empty();
  if (!mixes) return whole();

  const double least = LeastWidth(finest, *setup);
  if (least == 0) return whole();
  for (int first = CoarsestFor(detail * least, levels, count);; ++first) {
    LevelMap map = MapOf(detail, levels, first, *setup);
    // The frame's grid is a level that is drawn.
    if (std::ranges::find(map.of_zone, 0) == map.of_zone.end() && first + 1 < count) continue;
    // The boxes of a mesh are the same in all orthographic views, so their voxels stay where they are when the view turns.
    if (!levels.refined.empty() && camera.projection == Projection::kOrthographic) map = MapOf(detail, levels, first, *setup, true);
    return WithoutUnused(std::move(map));
  }
}

Result<double> DetailOf(const FrameRequest& request, const VolumeGeometry& finest, const std::shared_ptr<const VolumeSummary>& overview,
                        const ShownFields& fields) {
  const Result<FrameSetup> setup = SetupOfOverview(request, finest, overview, fields);
  if (!setup.ok()) return setup.status();
  if (LevelNumber(request.level)) return 0;  // that level of all fields, as far as they have it
  const VolumeGeometry& geometry = overview->description.geometry;
  const double least = LeastWidth(finest, *setup);
  const double width = least > 0 ? least : setup->unit * WidthAt(ExtentOf(geometry.bounds(), {}, setup->camera), setup->camera);
  return width * (request.detail == 0 ? 1 : request.detail);
}

FieldLevels LevelsOfField(const VolumeLevels& levels, const VolumeGeometry& finest, std::span<const VolumeGeometry> volume, double pixel) {
  constexpr double kSame = 1.001;
  FieldLevels found;
  for (const VolumeGeometry& drawn : volume) {
    const bool first = &drawn == &volume.front();
    const double width = std::max(first ? pixel : 0, kSame * CoarseSpacing(finest, drawn));
    const int level = CoarsestFor(width, levels, int(levels.levels.size()));
    if (found.levels.empty() || found.levels.back() < level) found.levels.push_back(level);
    found.of_volume.push_back(std::uint32_t(found.levels.size() - 1));
  }
  return found;
}

Result<ChosenView> ChooseView(const FrameRequest& request, const VolumeGeometry& finest,
                              const std::shared_ptr<const VolumeSummary>& overview, const std::optional<Ball>& framed,
                              const ShownFields& fields) {
  ChosenView chosen = {.view = WithDefaults(request.view, finest.orientation.world), .framed = framed};
  if (!std::exchange(chosen.view.fit, false).value()) return ChosenView{chosen.view, std::nullopt};
  if (!framed) {
    // Coarser levels have other indices.
    if (Status status = CheckSlices(request, finest); !status.ok()) return status;
    const Result<ResolvedRequest> resolved = ResolveRequest(AtLevel(request, finest, overview->description.geometry), 1, overview, fields);
    if (!resolved.ok()) return resolved.status();
    chosen.framed = resolved->framed;
  }
  if (chosen.framed) chosen.view = FitView(chosen.view, finest, *chosen.framed);
  return chosen;
}

FrameRequest AtLevel(FrameRequest request, const VolumeGeometry& finest, const VolumeGeometry& level) {
  if (finest == level) return request;
  ViewParameters& view = request.view;
  view = WithDefaults(view, level.orientation.world);
  if (!view.look_at && !*view.fit) view.look_at = finest.ToWorld(finest.centre());
  if (view.projection == Projection::kPerspective) {
    if (!view.eye && view.distance == 0) {
      view.distance = BoundingRadius(finest) / std::sin(view.fov_degrees * (std::numbers::pi / 360));
    }
  } else {
    const Vec3 centre = level.orientation.FromWorld(level.ToWorld(level.centre()) - finest.orientation.origin) / finest.spacing;
    view.distance = MakeCamera(view, request.size, finest).Project(centre).depth;
    if (!*view.fit) view.zoom *= BoundingRadius(level) / BoundingRadius(finest);
  }
  if (request.clipping.box) MoveBox(*request.clipping.box, finest, level);
  if (request.clipping.slab) MoveSlab(*request.clipping.slab, finest);
  for (PlaneChoice& plane : request.planes) MoveSlab(plane.slab, finest);
  request.transfer.opacity_distance *= Least(finest.spacing) / Least(level.spacing);
  return request;
}

}  // namespace slabstream
