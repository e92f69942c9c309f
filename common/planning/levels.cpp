#include "common/planning/levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "common/planning/frame_plan.h"
#include "common/planning/resolved_request.h"

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

// Physical width of the pixels that show the nearest point of the volume.
double LeastPixel(const Camera& camera, const VolumeGeometry& geometry) {
  if (camera.projection != Projection::kPerspective) return camera.PixelSizeAt(camera.target_depth);
  double nearest = std::numeric_limits<double>::infinity();
  const Vec3 low = {-0.5, -0.5, -0.5}, high = ToVec3(geometry.size) - Vec3{0.5, 0.5, 0.5};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = {(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y, (corner & 4) != 0 ? high.z : low.z};
    const auto& row = camera.depth_row;
    nearest = std::min(nearest, row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3]);
  }
  return camera.PixelSizeAt(std::max(nearest, 1e-6 * camera.target_depth));
}

// From positions along the voxels' axes of one geometry to those of another one: data-space coordinate -> data-space coordinate.
double Moved(double position, Axis axis, const VolumeGeometry& from, const VolumeGeometry& to) {
  const auto origin = [&](const VolumeGeometry& geometry) { return geometry.orientation.FromWorld(geometry.orientation.origin)[axis]; };
  return (origin(from) + from.spacing[axis] * position - origin(to)) / to.spacing[axis];
}

void MoveBox(ClipBox& box, const VolumeGeometry& finest, const VolumeGeometry& level) {
  if (box.unit == ClipUnit::kWorld) return;
  for (const Axis axis : kAxes) {
    for (double* const bound : {&box.low[axis], &box.high[axis]}) {
      if (std::abs(*bound) == kMaxWorldCoordinate) continue;
      const double voxels = box.unit == ClipUnit::kPercent ? *bound / 100 * finest.size[axis] : *bound;
      *bound = Moved(voxels - 0.5, axis, finest, level) + 0.5;
    }
  }
  box.unit = ClipUnit::kVoxels;
}

void MoveSlab(ClipSlab& slab, const VolumeGeometry& finest) {
  if (slab.through) return;
  Vec3 middle = finest.centre();
  if (slab.index) middle[AxisAcross(slab, finest)] = *std::exchange(slab.index, std::nullopt);
  slab.through = finest.ToWorld(middle);
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

Result<int> LevelOf(const FrameRequest& request, const VolumeLevels& levels) {
  const int count = int(levels.levels.size());
  const VolumeGeometry& finest = levels.levels.front().geometry;
  // Coarser levels have other indices.
  if (const Result<ClipRegion> clip = MakeClipRegion(request.clipping, finest); !clip.ok()) return clip.status();
  if (const std::optional<int> level = LevelNumber(request.level)) {
    if (*level < count) return *level;
    return Status::InvalidArgument(fmt::format("level is {}, but dataset \"{}\" has levels 0 to {}", *level, request.dataset, count - 1));
  }
  const VolumeGeometry& overview = levels.overview->description.geometry;
  const Result<ResolvedRequest> resolved = ResolveRequest(AtLevel(request, finest, overview), 1, levels.overview);
  if (!resolved.ok()) return resolved.status();
  const Result<FrameSetup> setup = MakeFrameSetup(*resolved);
  if (!setup.ok()) return setup.status();
  const double most = (request.detail == 0 ? 1 : request.detail) * LeastPixel(setup->camera, overview);
  int level = 0;
  for (int next = 1; next < count && CoarseSpacing(finest, levels.levels[std::size_t(next)].geometry) <= most; ++next) level = next;
  return level;
}

FrameRequest AtLevel(FrameRequest request, const VolumeGeometry& finest, const VolumeGeometry& level) {
  if (finest == level) return request;
  ViewParameters& view = request.view;
  if (!view.look_at && !view.fit) view.look_at = finest.ToWorld(finest.centre());
  if (view.projection == Projection::kPerspective) {
    if (!view.eye && view.distance == 0) {
      view.distance = BoundingRadius(finest) / std::sin(view.fov_degrees * (std::numbers::pi / 360));
    }
  } else {
    const Vec3 centre = level.orientation.FromWorld(level.ToWorld(level.centre()) - finest.orientation.origin) / finest.spacing;
    view.distance = MakeCamera(view, request.size, finest).Project(centre).depth;
    if (!view.fit) view.zoom *= BoundingRadius(level) / BoundingRadius(finest);
  }
  if (request.clipping.box) MoveBox(*request.clipping.box, finest, level);
  if (request.clipping.slab) MoveSlab(*request.clipping.slab, finest);
  request.transfer.opacity_distance *= Least(finest.spacing) / Least(level.spacing);
  return request;
}

}  // namespace slabstream
