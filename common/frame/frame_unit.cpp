#include "common/frame/frame_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

namespace slabstream {

double FrameUnitOf(const VolumeGeometry& geometry) {
  constexpr double kLeastRadius = 0.5, kLargestRadius = 0x1p20;
  constexpr int kUsual = 9;  // log2 of a radius in units
  const double radius = BoundingRadius(geometry);
  if (radius >= kLeastRadius && radius <= kLargestRadius) return 1;
  return std::ldexp(1, std::ilogb(radius) - kUsual);
}

VolumeGeometry InUnit(VolumeGeometry geometry, double unit) {
  geometry.spacing = geometry.spacing / unit;
  geometry.orientation.origin = geometry.orientation.origin / unit;
  return geometry;
}

ViewParameters InUnit(ViewParameters view, double unit) {
  if (view.look_at) view.look_at = *view.look_at / unit;
  if (view.eye) view.eye = *view.eye / unit;
  view.distance /= unit;
  return view;
}

ClipRegion InUnit(ClipRegion clip, double unit) {
  for (HalfSpace& side : clip.sides) side = {side.normal / unit, side.offset / unit};
  return clip;
}

TransferFunction InUnit(TransferFunction transfer, double unit) {
  const auto scaled = [unit](double slope) { return std::min(slope * unit, kMaxScalar); };
  for (GradientOpacityPoint& point : transfer.gradient_opacities) point.slope = scaled(point.slope);
  for (TransferRegion& region : transfer.regions) {
    for (RegionCorner& corner : region.corners) corner.slope = scaled(corner.slope);
  }
  return transfer;
}

Status CheckDrawable(const VolumeGeometry& geometry) {
  constexpr double kShortest = 1e-100, kLongest = 1e100, kFarthest = 1e200;  // squares and cubes are finite, and not 0
  constexpr double kMostSteps = 0x1p24;                                      // single precision numbers so many samples of a ray
  const Vec3& spacing = geometry.spacing;
  const auto refused = [](std::string_view field, const Vec3& value, const std::string& why) {
    return Status::InvalidArgument(fmt::format("the volume's {} is {:g}, {:g}, {:g}: {}", field, value.x, value.y, value.z, why));
  };
  for (const Axis axis : kAxes) {
    if (!(spacing[axis] >= kShortest && spacing[axis] <= kLongest)) {
      return refused("spacing", spacing, fmt::format("volumes can be drawn if each is in [{:g}, {:g}]", kShortest, kLongest));
    }
    if (!(std::abs(geometry.orientation.origin[axis]) <= kFarthest)) {
      return refused("origin", geometry.orientation.origin, fmt::format("volumes can be drawn if each is at most {:g} from 0", kFarthest));
    }
  }
  const double steps = 2 * BoundingRadius(geometry) / Least(spacing);
  if (steps <= kMostSteps) return Status::Ok();
  return refused(
      "spacing", spacing,
      fmt::format("the volume is {:.3g} times as long as the shortest side of a voxel, and can be drawn up to {:.3g} times; another "
                  "unit along that side brings it nearer to the others",
                  steps, kMostSteps));
}

Status CheckDrawable(const Camera& camera) {
  const auto finite = [](const auto& row) { return std::ranges::all_of(row, [](double number) { return std::abs(number) <= 1e300; }); };
  const Vec3& eye = camera.eye;
  if (finite(camera.x_row) && finite(camera.y_row) && finite(camera.w_row) && finite(camera.depth_row) &&
      finite(std::array{eye.x, eye.y, eye.z})) {
    return Status::Ok();
  }
  return Status::InvalidArgument("view: the eye or the point that it looks at is too far from the volume");
}

}  // namespace slabstream
