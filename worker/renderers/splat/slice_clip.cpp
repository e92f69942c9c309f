#include "worker/renderers/splat/slice_clip.h"

#include <algorithm>
#include <cmath>

#include "worker/kernels/normal_code.h"

namespace slabstream {

SliceClip::SliceClip(const FrameSetup& setup) : setup_(setup), axes_(AxesOf(setup.camera.traversal_axis)) {
  const Vec3& spacing = setup.description.geometry.spacing;
  face_reach_ = kFaceDepth * Least(spacing);
  for (const HalfSpace& side : setup.clip.sides) {
    const Vec3 normal = side.normal / spacing;
    normals_.push_back(EncodeNormal(float(normal.x), float(normal.y), float(normal.z)));
  }
}

std::array<ColumnInterval, 2> SliceClip::ColumnsLeft(std::int32_t k, std::int32_t row) const {
  const SheetGrid& grid = setup_.sheets;
  const SlicePlacement place = PlaceSlice(grid, k);
  const double v = (row + 0.5 - place.offset_v) / place.scale_v;
  // Borders between columns: column i is inside if begin <= i < end.
  double begin = 0, end = grid.width;
  for (const HalfSpace& side : setup_.clip.sides) {
    // The distance is rise * x + at_0 at x = i + 0.5.
    const double rise = side.normal[axes_.u] / place.scale_u;
    const double at_0 = side.normal[axes_.v] * v + side.normal[axes_.c] * k + side.offset - rise * place.offset_u;
    if (std::abs(rise) < 1e-12) {
      if (at_0 < 0) end = 0;
    } else if (rise > 0) {
      begin = std::max(begin, std::ceil(-at_0 / rise - 0.5));
    } else {
      end = std::min(end, std::floor(-at_0 / rise - 0.5) + 1);
    }
  }
  const bool any = begin < end;
  if (setup_.clip.mode == ClipMode::kKeep) return {ColumnInterval{any ? std::int32_t(begin) : 0, any ? std::int32_t(end) : 0}, {}};
  if (!any) return {ColumnInterval{0, grid.width}, {}};
  return {ColumnInterval{0, std::int32_t(begin)}, {std::int32_t(end), grid.width}};
}

bool SliceClip::LightCuts(std::int32_t k, std::int32_t v, std::int32_t u, std::int32_t count, std::uint16_t* normals) const {
  Vec3 p;
  p[axes_.c] = k;
  p[axes_.v] = v;
  // Mostly the whole row is far within all sides, or far beyond one.
  bool near = false;
  for (const HalfSpace& side : setup_.clip.sides) {
    p[axes_.u] = u;
    const double first = side.Distance(p), last = first + (count - 1) * side.normal[axes_.u];
    if (std::max(first, last) <= -face_reach_) return false;
    near = near || std::min(first, last) < face_reach_;
  }
  if (!near) return false;
  bool any = false;
  for (std::int32_t i = 0; i < count; ++i) {
    p[axes_.u] = u + i;
    // The side that the voxel is nearest to, or farthest beyond.
    std::size_t nearest = 0;
    double least = setup_.clip.sides[0].Distance(p);
    for (std::size_t side = 1; side < normals_.size(); ++side) {
      const double distance = setup_.clip.sides[side].Distance(p);
      if (distance >= least) continue;
      least = distance;
      nearest = side;
    }
    if (std::abs(least) >= face_reach_) continue;
    normals[i] = normals_[nearest];
    any = true;
  }
  return any;
}

}  // namespace slabstream
