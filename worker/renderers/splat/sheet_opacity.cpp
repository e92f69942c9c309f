#include "worker/renderers/splat/sheet_opacity.h"

#include <algorithm>
#include <cmath>

namespace slabstream {

SheetOpacity::SheetOpacity(const FrameSetup& setup) : setup_(setup), axes_(AxesOf(setup.camera.traversal_axis)) {
  const Camera& camera = setup.camera;
  central_distance_ = camera.spacing[axes_.c] / std::abs(camera.view_direction[axes_.c]);
  if (camera.projection != Projection::kPerspective) return;
  // The ratio grows with the angle between a ray and the axis. It is largest at a corner of the volume, and least on the ray nearest to the
  // axis, which meets a face of the volume or passes through the eye's foot point.
  const Vec3 high = ToVec3(setup.description.geometry.size) - Vec3{1, 1, 1};
  double largest = 0;
  least_ratio_ = 1e300;
  for (const double at_c : {0.0, high[axes_.c]}) {
    Vec3 nearest;
    for (Axis axis : kAxes) nearest[axis] = std::clamp(camera.eye[axis], 0.0, high[axis]);
    nearest[axes_.c] = at_c;
    least_ratio_ = std::min(least_ratio_, Ratio(nearest));
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 q = {corner & 1 ? high.x : 0, corner & 2 ? high.y : 0, corner & 4 ? high.z : 0};
      largest = std::max(largest, Ratio(q));
    }
  }
  constexpr int kLevels = 32;  // the interpolation error is then below 1e-4 for any opacity and a field of view of 60 degrees
  levels_ = kLevels;
  levels_per_ratio_ = (kLevels - 1) / std::max(largest - least_ratio_, 1e-9);
}

double SheetOpacity::Ratio(const Vec3& voxel) const {
  const Camera& camera = setup_.camera;
  const Vec3 ray = (voxel - camera.eye) * camera.spacing;
  return Length(ray) / std::abs(ray[axes_.c]) * camera.spacing[axes_.c] / central_distance_;
}

SheetOpacity::Slopes SheetOpacity::SlopesIn(std::int32_t k) const {
  if (one_level()) return {};
  const auto [c, u, v] = axes_;
  const Camera& camera = setup_.camera;
  const double depth = (k - camera.eye[c]) * camera.spacing[c];
  return {float(-camera.eye[u] * camera.spacing[u] / depth), float(camera.spacing[u] / depth),
          float(-camera.eye[v] * camera.spacing[v] / depth), float(camera.spacing[v] / depth)};
}

ShadeTables SheetOpacity::Tables(const ClassificationTable& table) const {
  const Camera& camera = setup_.camera;
  const double voxel_length = Least(camera.spacing);
  const double exponent = central_distance_ / (table.opacity_distance * voxel_length);
  ShadeTables tables;
  tables.levels = levels_;
  // In levels, a ray's ratio is its length over the spacing of slices.
  constexpr double kBelowLast = 1e-3;  // so that there is always a level above
  tables.level_scale = float(levels_per_ratio_ * camera.spacing[axes_.c] / central_distance_);
  tables.level_offset = float(levels_per_ratio_ * least_ratio_);
  tables.last_level = float(std::max(levels_ - 1 - kBelowLast, 0.0));
  for (int bin = 0; bin < table.size(); ++bin) {
    const Rgb& color = table.color[std::size_t(bin)];
    for (float f : {color.r, color.g, color.b, 0.0F}) tables.color.push_back(f);
  }
  // (1 - alpha)^(ratio exponent) for evenly spaced ratios is a geometric sequence.
  const double step = levels_ == 1 ? 0 : 1 / levels_per_ratio_;
  tables.opacity.resize(std::size_t(levels_) * std::size_t(table.size()));
  for (int bin = 0; bin < table.size(); ++bin) {
    const double log_transmitted = exponent * std::log1p(-double(table.opacity[std::size_t(bin)]));
    double transmitted = std::exp(least_ratio_ * log_transmitted);
    const double per_level = std::exp(step * log_transmitted);
    for (int level = 0; level < levels_; ++level, transmitted *= per_level) {
      tables.opacity[std::size_t(bin * levels_ + level)] = float(1 - transmitted);
    }
    tables.color[4 * std::size_t(bin) + 3] = tables.opacity[std::size_t(bin * levels_)];
  }
  tables.by_normal = PhongTable(setup_.shading, camera.view_direction);
  return tables;
}

}  // namespace slabstream
