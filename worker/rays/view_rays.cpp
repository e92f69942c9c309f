#include "worker/rays/view_rays.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace slabstream {
namespace {

// The depth in the middle of a slab that faces the view; its surfaces are two sides of the region. None: there is no slab.
std::optional<double> MiddleOfSlab(const Camera& camera, const ClipRegion& clip) {
  if (camera.projection != Projection::kOrthographic || clip.mode != ClipMode::kKeep) return std::nullopt;
  constexpr double kFacing = 1 - 1e-9;
  double enter = -1e300, leave = 1e300;
  for (const HalfSpace& side : clip.sides) {
    const double facing = Dot(side.normal / camera.spacing, camera.view_direction);
    const double depth = -side.Distance(camera.eye) / facing;
    if (facing > kFacing) enter = std::max(enter, depth);
    if (facing < -kFacing) leave = std::min(leave, depth);
  }
  if (enter == -1e300 || leave == 1e300 || enter > leave) return std::nullopt;
  return 0.5 * (enter + leave);
}

}  // namespace

double StepOf(const VolumeGeometry& geometry, double samples_per_voxel) {
  if (!geometry.rectilinear()) return Least(geometry.spacing) / samples_per_voxel;
  const double diagonal = Length(ToVec3(geometry.size) * geometry.spacing);
  return std::max(geometry.least_distance() / samples_per_voxel, diagonal / kMostInDiagonal);
}

ViewRays MakeViewRays(const Camera& camera, const VolumeGeometry& geometry, double samples_per_voxel, const ClipRegion& clip) {
  const Vec3 spacing = geometry.spacing;
  const double step = StepOf(geometry, samples_per_voxel);
  const double radius = 0.5 * Length(ToVec3(geometry.size) * spacing);
  const Vec3 middle = geometry.centre();
  const double centre_depth = camera.Project(middle).depth;
  double first = std::max(std::floor((centre_depth - radius) / step), 0.0);
  if (const auto middle_depth = MiddleOfSlab(camera, clip)) first += *middle_depth / step - std::ceil(*middle_depth / step);

  ViewRays rays;
  rays.perspective = camera.projection == Projection::kPerspective;
  // Whole and half numbers: a pixel's position relative to the centre is exact in single precision.
  rays.centre_x = float(0.5 * camera.width - 0.5);
  rays.centre_y = float(0.5 * camera.height - 0.5);
  const double x = 0.5 * camera.width, y = 0.5 * camera.height;
  const auto offset = [&](const Camera::Ray& from, const Camera::Ray& to) {
    return rays.perspective ? to.direction - from.direction : to.origin - from.origin;
  };
  const Camera::Ray centre = camera.RayAt(x, y);
  const Vec3 right = offset(centre, camera.RayAt(x + 1, y));
  rays.right = ToFloat3(right);
  rays.down = ToFloat3(offset(centre, camera.RayAt(x, y + 1)));
  rays.forward = ToFloat3(centre.direction);
  rays.start = ToFloat3(centre.origin + first * step * centre.direction);
  rays.pixel_squared = float(Dot(right * spacing, right * spacing));
  rays.bend = rays.pixel_squared;
  rays.start_distance = float(first * step);
  rays.step = float(step);
  // Under perspective samples lie at distances from the eye, which are larger than depths.
  const double farthest = std::max(centre_depth, rays.perspective ? Length((middle - camera.eye) * spacing) : 0) + radius;
  constexpr double kMostSamples = 0x1p24;  // single precision numbers so many; only eyes beside the picture would see more
  rays.sample_count = std::int32_t(std::clamp(std::ceil(farthest / step) - first, 0.0, kMostSamples)) + 1;
  rays.volume_end = ToFloat3(ToVec3(geometry.size) - Vec3{0.5, 0.5, 0.5});
  for (const HalfSpace& side : clip.sides) rays.clip.sides.push_back({ToFloat3(side.normal), float(side.offset)});
  rays.clip.cut_away = clip.mode == ClipMode::kCutAway && !clip.empty();  // without sides nothing is clipped
  rays.clip.face_depth = float(kFaceDepth * Least(spacing));
  return rays;
}

ViewRays Jittered(ViewRays rays, const Camera& camera, const ClipRegion& clip, double jitter) {
  if (!MiddleOfSlab(camera, clip)) rays.jitter = float(jitter);
  return rays;
}

RayReach ReachOfBox(const ViewRays& rays, const Camera& camera, const Vec3& low, const Vec3& high) {
  constexpr double kPixelSlack = 0.01;
  constexpr std::int32_t kSampleSlack = 2;
  double left = camera.width, right = 0, top = camera.height, bottom = 0, nearest = 1e300, farthest = 0;
  // Positions of samples are rounded: see the header.
  const double error =
      0x1p-21 * std::max({1.0, std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x), std::abs(high.y), std::abs(high.z)});
  const Vec3 from = low - Vec3{error, error, error}, to = high + Vec3{error, error, error};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = {corner & 1 ? to.x : from.x, corner & 2 ? to.y : from.y, corner & 4 ? to.z : from.z};
    const Camera::ImagePoint at = camera.Project(p);
    left = std::min(left, at.x);
    right = std::max(right, at.x);
    top = std::min(top, at.y);
    bottom = std::max(bottom, at.y);
    nearest = std::min(nearest, at.depth);  // no point is nearer to the eye than its plane of depth
    farthest = std::max(farthest, rays.perspective ? Length((p - camera.eye) * camera.spacing) : at.depth);
  }
  const auto sample = [&](double distance) {
    const double number = (distance - double(rays.start_distance)) / double(rays.step);
    return std::int32_t(std::clamp(number, -double(kSampleSlack), double(rays.sample_count)));
  };
  // A pixel counts if its centre is inside.
  const auto first_pixel = [](double x, std::int32_t count) {
    return std::int32_t(std::clamp(std::ceil(x - 0.5 - kPixelSlack), 0.0, double(count)));
  };
  RayReach reach;
  reach.begin = std::clamp(sample(nearest) - kSampleSlack, 0, rays.sample_count);
  reach.end = std::clamp(sample(farthest) + 1 + kSampleSlack, reach.begin, rays.sample_count);
  reach.pixels = {first_pixel(left, camera.width), first_pixel(top, camera.height), first_pixel(right + 2 * kPixelSlack, camera.width),
                  first_pixel(bottom + 2 * kPixelSlack, camera.height)};
  return reach;
}

double VoxelsASample(const ViewRays& rays, const Camera& camera, const VolumeGeometry& geometry) {
  const double depth = rays.perspective ? camera.Project(geometry.centre()).depth : 1;
  const double voxel = geometry.spacing.x * geometry.spacing.y * geometry.spacing.z;
  return double(rays.pixel_squared) * depth * depth * double(rays.step) / voxel;
}

}  // namespace slabstream
